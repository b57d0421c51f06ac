// Records of a run that persons keep and fetch: notes, tags, files.

import { get, getTag, patch, saveFile, start } from "../common/api.js";
import { element, instant, write } from "../common/format.js";
import { need } from "../common/rights.js";
import { keepOperatorName, operatorName, recordedName } from "../common/session.js";
import { foldedSection, table } from "../common/tables.js";

const SIZES = [["GB", 1e9], ["MB", 1e6], ["kB", 1e3]];

const pathOf = (run) => `runs/${encodeURIComponent(run.id)}`;

/** Size of a file in words. */
function fileSize(bytes) {
  if (bytes === null) return "made at its request";
  const [unit, size] = SIZES.find(([, least]) => bytes >= least) ?? ["bytes", 1];
  return `${size === 1 ? bytes : (bytes / size).toFixed(1)} ${unit}`;
}

/** Sections of the records: notes and tags, and the files, which are listed once their section is opened. */
export class RunRecords {
  constructor(run) {
    this.run = run;
    this.notes = new RunNotes(run);
    const notes = foldedSection("Notes and tags", { open: true });
    notes.body.append(...this.notes.content);
    this.files = foldedSection("Files", { whenOpened: () => showFiles(this.files.body, this.run) });
    this.sections = [notes.section, this.files.section];
  }

  /** Loads what is open; new results are new files. */
  async load() {
    const isOpen = this.files.section.querySelector("details").open;
    await Promise.all([this.notes.load(), isOpen ? showFiles(this.files.body, this.run) : null]);
  }

  update(run) {
    this.run = run;
    this.notes.update(run);
  }
}

/** Notes and tags with the forms that add them. A change does not touch what a person is writing. */
class RunNotes {
  constructor(run) {
    this.run = run;
    this.author = field("Your name", { maxLength: 200, required: true, autocomplete: "off", value: operatorName(), readOnly: recordedName() !== "" });
    this.text = field("Note", { tag: "textarea", maxLength: 10_000, rows: 3 });
    this.tag = field("New tag", { maxLength: 60, autocomplete: "off" });
    this.tags = element("ul", { className: "tags", "aria-label": "Tags" });
    this.list = element("ol", { className: "notes" }, element("li", { className: "soft" }, "Loading …"));
    this.answer = element("p", { className: "note", role: "status" });
    const add = need("operate", element("button", { type: "submit", className: "primary" }, "Add note"));
    const addTag = need("operate", element("button", { type: "button" }, "Add tag"));
    addTag.addEventListener("click", () => this.addTag());
    this.form = element("form", { className: "record-form" }, this.author.label, this.text.label, element("p", { className: "actions" }, add),
      this.tag.label, element("p", { className: "actions" }, addTag));
    this.form.addEventListener("submit", (event) => {
      event.preventDefault();
      if (document.activeElement === this.tag.input) this.addTag();
      else this.addNote();
    });
    this.content = [this.tags, this.list, this.form, this.answer];
    this.update(run);
  }

  /** Loads the notes, the oldest first. */
  async load() {
    try {
      const { items, next } = await get(`${pathOf(this.run)}/notes`);
      this.list.replaceChildren(...items.map(describeNote), ...(items.length ? [] : [element("li", { className: "soft" }, "No notes yet.")]),
        ...(next === null ? [] : [element("li", { className: "soft" }, `Only the oldest ${items.length} notes are shown.`)]));
    } catch (problem) {
      write(this.answer, problem.after("The notes cannot be shown"));
    }
  }

  /** Shows the tags of a changed run. */
  update(run) {
    const isSame = this.tags.childElementCount && run.tags.join("\n") === this.run.tags.join("\n");
    this.run = run;
    if (isSame) return;
    this.tags.replaceChildren(...run.tags.map((tag) => this.showTag(tag)), ...(run.tags.length ? [] : [element("li", { className: "soft" }, "No tags.")]));
  }

  showTag(tag) {
    const button = need("operate", element("button", { type: "button", "aria-label": `Remove the tag ${tag}` }, "Remove"));
    button.addEventListener("click", () => this.changeTags((tags) => tags.filter((one) => one !== tag), `The tag ${tag} was removed.`));
    return element("li", {}, element("span", {}, tag), button);
  }

  async addNote() {
    const [author, text] = [this.readAuthor(), this.text.input.value.trim()];
    if (!author || !text) return write(this.answer, "Not added: give your name and a text.");
    await this.attempt("Not added", async () => {
      await start(`${pathOf(this.run)}/notes`, { author, text });
      this.text.input.value = "";
      return "The note was added.";
    });
  }

  async addTag() {
    const tag = this.tag.input.value.trim();
    if (!tag) return write(this.answer, "Not added: write a tag.");
    const isAdded = await this.changeTags((tags) => [...new Set([...tags, tag])], `The tag ${tag} was added.`);
    if (isAdded) this.tag.input.value = "";
  }

  /** Changes the tags as they are now on the service; refused if another person changes them in between. */
  async changeTags(change, words) {
    const author = this.readAuthor();
    if (!author) return write(this.answer, "Not changed: give your name.");
    return this.attempt("Not changed", async () => {
      const { data, etag } = await getTag(pathOf(this.run));
      this.update(await patch(pathOf(this.run), { author, tags: change(data.tags) }, etag));
      return words;
    });
  }

  readAuthor() {
    const author = this.author.input.value.trim();
    if (author) keepOperatorName(author);
    else this.author.input.focus();
    return author;
  }

  async attempt(failure, act) {
    try {
      const words = await act();
      await this.load();
      write(this.answer, words);
      return true;
    } catch (problem) {
      write(this.answer, problem.after(failure));
      return false;
    }
  }
}

function describeNote({ at, author, kind, text }) {
  return element("li", {}, element("small", {}, `${instant(at)}, ${author}${kind === "tags" ? ", tags" : ""}`), element("p", {}, text));
}

function field(label, { tag = "input", ...properties }) {
  const input = element(tag, properties);
  return { input, label: element("label", {}, label, input) };
}

/** Table of the files of a run with size and hash; each is saved by its button. */
async function showFiles(place, run) {
  const answer = element("p", { className: "note", role: "status" });
  try {
    const { items } = await get(`${pathOf(run)}/files`);
    const rows = items.map((one) => [
      one.name, one.kind, fileSize(one.size), one.made ? instant(one.made) : "–",
      element("span", { className: "path" }, one.sha256 ?? "–"), saveButton(one, answer),
    ]);
    place.replaceChildren(table("Files of this run", ["File", "Content", "Size", "Made", "SHA-256", "Save"], rows), answer);
  } catch (problem) {
    place.replaceChildren(element("p", { className: "problem" }, problem.after("The files cannot be listed")));
  }
}

function saveButton({ name, path, job }, answer) {
  const button = element("button", { type: "button", "aria-label": `Save ${name}${job ? ` of job ${job}` : ""}` }, "Save");
  button.addEventListener("click", async () => {
    write(answer, `${name} is fetched …`);
    try {
      write(answer, `${await saveFile(path.replace("/api/v1/", ""), name)} was saved.`);
    } catch (problem) {
      write(answer, problem.after("Not saved"));
    }
  });
  return button;
}
