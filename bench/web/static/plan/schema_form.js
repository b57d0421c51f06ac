// Form for a JSON document, made from its JSON Schema: every key with its unit, whatever kind of object it belongs to.

import { element, spaced, write } from "../common/format.js";

const UNIT = /^\[([^\]]+)\] (.*)$/;
const SUFFIX = /_(m|s|hz|n|mps|mps2)$/;
/** Keys whose text needs a wider field. */
const LONG = ["title", "description"];
/** Digits that are shown, and digits to which an entry is converted; a value that nobody touches is not rounded. */
const [SHOWN_DIGITS, DIGITS] = [6, 12];

const getAt = (document, path) => path.reduce((value, key) => value?.[key], document);
const capitalised = (text) => text.replace(/^./, (first) => first.toUpperCase());

/** Name of a key without the suffix of its unit: `corner_acceleration_mps2` is `Corner acceleration`. */
export const describeKey = (key) => capitalised(spaced(String(key).replace(SUFFIX, "")));

export class SchemaForm {
  /**
   * Takes the schemas by name, and functions: from a unit of a description to `{ unit, scale }`, from a value of a choice
   * to its name, and one that is called after each change. `document` is always the present state.
   */
  constructor(schemas, { unitOf, nameOf, onChange }) {
    Object.assign(this, { schemas, unitOf, nameOf, onChange });
    this.place = element("div", { className: "form" });
    this.open = new WeakSet(); // items of lists, which keep their state when they are moved
  }

  /** Shows a document that a schema describes. */
  show(schema, document) {
    Object.assign(this, { schema, document });
    this.fields = new Map();
    this.place.replaceChildren(...this.makeObject(this.resolve(schema), []));
  }

  /** Changes the structure and shows the form again; the focus moves to a path. */
  rebuild(change, focus) {
    change();
    this.show(this.schema, this.document);
    this.fields.get(focus.join("."))?.field.focus();
    this.onChange();
  }

  resolve(schema) {
    const name = schema.$ref?.split("/").at(-1);
    return name ? { ...this.schemas[name], ...(schema.description && { description: schema.description }) } : schema;
  }

  /** Returns the schema of a union without null, and whether null or absence is allowed. */
  unwrap(schema) {
    const some = schema.anyOf?.filter(({ type }) => type !== "null");
    return some?.length === 1 ? { ...this.resolve(some[0]), description: schema.description, isOptional: true } : this.resolve(schema);
  }

  set(path, value) {
    const owner = getAt(this.document, path.slice(0, -1));
    if (value === undefined) delete owner[path.at(-1)];
    else owner[path.at(-1)] = value;
  }

  /** Elements of all keys of an object: simple ones side by side, objects and lists below. */
  makeObject(schema, path) {
    const all = Object.entries(schema.properties).filter(([, one]) => one.const === undefined)
      .map(([key, one]) => [key, this.unwrap(one)]);
    const isSimple = ([, one]) => !one.properties && !one.oneOf && !(one.type === "array" && this.isListOfObjects(one));
    const simple = all.filter(isSimple).map(([key, one]) => this.makeField(one, [...path, key]));
    const nested = all.filter((entry) => !isSimple(entry)).map(([key, one]) => this.makePart(one, [...path, key]));
    return [...(simple.length ? [element("div", { className: "fields" }, ...simple)] : []), ...nested];
  }

  isListOfObjects({ items }) {
    return Boolean(this.resolve(items).properties);
  }

  makePart(schema, path) {
    if (schema.type === "array") return this.makeList(schema, path);
    if (schema.isOptional) return this.makeOptional(schema, path);
    if (schema.properties && !getAt(this.document, path)) this.set(path, {});
    const part = schema.oneOf ? this.makeUnion(schema, path) : this.makeObject(schema, path);
    return this.makeGroup(describeKey(path.at(-1)), part, path);
  }

  /** Group with a title and a place for a problem. */
  makeGroup(title, children, path) {
    const error = element("small", { className: "problem", role: "alert" });
    const group = element("fieldset", { tabIndex: -1 }, element("legend", {}, title), error, ...children);
    this.fields.set(path.join("."), { field: group, error });
    return group;
  }

  /** Object that may be left out, with a box to add it. */
  makeOptional(schema, path) {
    const value = getAt(this.document, path);
    const box = element("input", { type: "checkbox", checked: Boolean(value) });
    box.addEventListener("change", () => this.rebuild(() => this.set(path, box.checked ? this.makeEmpty(schema) : undefined), path));
    const label = element("label", { className: "check" }, box, schema.description.replace(/\.$/, ""));
    const group = this.makeGroup(describeKey(path.at(-1)), [label, ...(value ? this.makeObject(schema, path) : [])], path);
    this.fields.set(path.join("."), { field: box, error: group.querySelector(".problem") });
    return group;
  }

  /** Object of one of several kinds; values that both kinds have stay when the kind is changed. */
  makeUnion(schema, path) {
    const { propertyName, mapping } = schema.discriminator;
    const value = getAt(this.document, path);
    const kinds = schema.oneOf.map(({ $ref }) => Object.keys(mapping).find((kind) => mapping[kind] === $ref));
    const choice = element("select", {}, ...kinds.map((kind) => element("option", { value: kind }, kind)));
    choice.value = value[propertyName];
    const change = () => {
      const next = this.resolve({ $ref: mapping[choice.value] });
      const kept = Object.entries(getAt(this.document, path)).filter(([key]) => key in next.properties && key !== propertyName);
      this.set(path, { ...this.makeEmpty(next), ...Object.fromEntries(kept) });
    };
    choice.addEventListener("change", () => this.rebuild(change, [...path, propertyName]));
    const own = this.resolve({ $ref: mapping[value[propertyName]] });
    const kind = this.wrap(choice, "Kind", own.description, [...path, propertyName]);
    const [first, ...others] = this.makeObject(own, path);
    if (!first?.classList.contains("fields")) return [element("div", { className: "fields" }, kind), ...(first ? [first] : []), ...others];
    first.prepend(kind);
    return [first, ...others];
  }

  /** List of objects, each with buttons; the first is open. */
  makeList(schema, path) {
    const items = getAt(this.document, path) ?? [];
    if (items.length && !items.some((item) => this.open.has(item))) this.open.add(items[0]);
    const parts = items.map((item, k) => this.makeItem(this.resolve(schema.items), [...path, k], items));
    const add = element("button", { type: "button" }, `Add to ${describeKey(path.at(-1)).toLowerCase()}`);
    add.addEventListener("click", () => this.rebuild(() => {
      const made = items.length ? copyItem(items.at(-1), items) : this.makeEmpty(this.resolve(schema.items));
      this.open.add(made);
      this.set(path, [...items, made]);
    }, [...path, items.length]));
    return this.makeGroup(describeKey(path.at(-1)), [...parts, element("p", { className: "actions" }, add)], path);
  }

  makeItem(schema, path, items) {
    const k = path.at(-1);
    const item = items[k];
    const title = `${k + 1}: ${item.name ?? describeItem(item)}`;
    const move = (by) => this.rebuild(() => items.splice(k + by, 0, ...items.splice(k, 1)), [...path.slice(0, -1), k + by]);
    const duplicate = () => {
      const made = copyItem(item, items);
      this.open.add(made);
      items.splice(k + 1, 0, made);
    };
    const buttons = [
      this.makeButton(`Duplicate ${title}`, "Duplicate", () => this.rebuild(duplicate, [...path.slice(0, -1), k + 1])),
      k > 0 ? this.makeButton(`Move up ${title}`, "Up", () => move(-1)) : null,
      k < items.length - 1 ? this.makeButton(`Move down ${title}`, "Down", () => move(1)) : null,
      items.length > 1 ? this.makeButton(`Remove ${title}`, "Remove", () => this.rebuild(() => items.splice(k, 1), path.slice(0, -1))) : null,
    ];
    const error = element("small", { className: "problem", role: "alert" });
    const summary = element("summary", {}, title);
    const part = element("details", { open: this.open.has(item) }, summary, error,
      ...this.makeObject(schema, path), element("p", { className: "actions" }, ...buttons));
    part.addEventListener("toggle", () => (part.open ? this.open.add(item) : this.open.delete(item)));
    this.fields.set(path.join("."), { field: summary, error });
    return part;
  }

  makeButton(label, text, act) {
    const button = element("button", { type: "button", "aria-label": label }, text);
    button.addEventListener("click", act);
    return button;
  }

  /** Field of a number, a list of numbers, a text, a choice or a yes. */
  makeField(schema, path) {
    const [, unit = "", text = schema.description ?? ""] = UNIT.exec(schema.description ?? "") ?? [];
    const shown = unit ? this.unitOf(unit) : { unit: "", scale: 1 };
    const value = getAt(this.document, path) ?? schema.default;
    const { field, read } = makeControl(schema, value, shown.scale, this.nameOf);
    const isList = schema.type === "array";
    field.addEventListener("input", () => {
      this.set(path, read());
      this.onChange(path);
    });
    const label = `${describeKey(path.at(-1))}${isList ? ", separated by commas" : ""}${shown.unit ? ` [${shown.unit}]` : ""}`;
    return this.wrap(field, label, text, path);
  }

  /** Label around a field, with its explanation and a place for a problem. */
  wrap(field, label, hint, path) {
    const key = path.join(".");
    const error = element("small", { className: "problem", role: "alert", id: `problem-${key}` });
    const isSaid = hint.replace(/\.$/, "").toLowerCase() === label.replace(/ \[.*/, "").toLowerCase();
    const more = hint && !isSaid ? element("small", { id: `hint-${key}` }, capitalised(hint.replaceAll("`", ""))) : null;
    field.setAttribute("aria-describedby", [more?.id, error.id].filter(Boolean).join(" "));
    this.fields.set(key, { field, error });
    const isBox = field.type === "checkbox";
    const name = element("span", {}, label);
    const labelled = element("label", { className: isBox ? "check" : "" }, ...(isBox ? [field, name] : [name, field]));
    return element("div", { className: LONG.includes(path.at(-1)) ? "field wide" : "field" }, labelled, more, error);
  }

  /** Smallest object of a schema: its constants, required objects, and a first seed. */
  makeEmpty(schema) {
    const made = {};
    for (const [key, raw] of Object.entries(schema.properties)) {
      const one = this.resolve(raw);
      if (one.const !== undefined) made[key] = one.const;
      else if (key === "seed") made[key] = 1;
      else if (schema.required?.includes(key) && one.properties) made[key] = this.makeEmpty(one);
      else if (schema.required?.includes(key) && one.oneOf) made[key] = this.makeEmpty(this.resolve(one.oneOf[0]));
      else if (one.type === "array" && this.isListOfObjects(one)) made[key] = [this.makeEmpty(this.resolve(one.items))];
    }
    return made;
  }

  /** Shows a problem beside the field of a path, or of the nearest object around it; returns that field. */
  showProblem(path, text) {
    for (const { field, error } of this.fields.values()) {
      write(error, "");
      field.removeAttribute("aria-invalid");
    }
    let at = path;
    while (at.length && !this.fields.has(at.join("."))) at = at.slice(0, -1);
    const found = this.fields.get(at.join("."));
    if (!found || !text) return null;
    for (let part = found.field.closest("details"); part; part = part.parentElement.closest("details")) part.open = true;
    if (found.field.matches("input, select, textarea")) found.field.setAttribute("aria-invalid", "true");
    write(found.error, text);
    return found.field;
  }
}

/** Copies an object of a list; its name becomes one that no other has. */
function copyItem(item, items) {
  const copy = structuredClone(item);
  if (!copy.name) return copy;
  const names = items.map(({ name }) => name);
  const stem = copy.name.replace(/_copy\d*$/, "");
  for (let k = 1; names.includes(copy.name); k++) copy.name = `${stem}_copy${k > 1 ? k : ""}`;
  return copy;
}

const describeItem = (item) => Object.values(item).filter((value) => typeof value !== "object").join(", ") || "new";

/** Creates the control of a simple value, and the function that reads it in SI; an empty field leaves its key out. */
function makeControl(schema, value, scale, nameOf) {
  const show = (number) => String(Number((number * scale).toPrecision(SHOWN_DIGITS)));
  const take = (text) => Number((Number(text) / scale).toPrecision(DIGITS));
  if (schema.type === "boolean") {
    const field = element("input", { type: "checkbox", checked: Boolean(value) });
    return { field, read: () => field.checked };
  }
  if (schema.enum) {
    const field = element("select", {}, ...schema.enum.map((one) => element("option", { value: one }, nameOf(one))));
    field.value = value ?? schema.enum[0];
    return { field, read: () => field.value };
  }
  if (schema.type === "array") {
    const field = element("input", { value: (value ?? []).map(show).join(", "), inputMode: "text" });
    const read = () => (field.value.trim() ? field.value.trim().split(/[\s,;]+/).filter(Boolean).map(take) : undefined);
    return { field, read };
  }
  if (schema.type === "string") {
    const field = element("input", { value: value ?? "" });
    return { field, read: () => field.value };
  }
  const field = element("input", { type: "number", step: "any", value: value === undefined || value === null ? "" : show(value) });
  return { field, read: () => (field.value === "" ? undefined : take(field.value)) };
}
