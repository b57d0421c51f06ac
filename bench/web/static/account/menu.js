// Menu below a button, for pointer, keyboard and screen reader: arrows, Home and End move, Escape and Tab close.

const STEPS = { ArrowDown: 1, ArrowUp: -1 };

export class Menu {
  /** Takes the button and the list with `role="menu"`. */
  constructor(button, list) {
    Object.assign(this, { button, list });
    button.addEventListener("click", () => (this.isOpen ? this.close() : this.open(0)));
    button.addEventListener("keydown", (event) => {
      if (!(event.key in STEPS)) return;
      event.preventDefault();
      this.open(event.key === "ArrowDown" ? 0 : -1);
    });
    list.addEventListener("keydown", (event) => this.onKey(event));
    list.addEventListener("click", () => this.close());
    document.addEventListener("pointerdown", ({ target }) => this.isOpen && !list.contains(target) && !button.contains(target) && this.show(false));
  }

  get isOpen() {
    return !this.list.hidden;
  }

  get items() {
    return [...this.list.querySelectorAll("[role=menuitem]")].filter((one) => !one.hidden);
  }

  open(index) {
    this.show(true);
    this.items.at(index).focus();
  }

  close() {
    this.show(false);
    this.button.focus();
  }

  show(isOpen) {
    this.list.hidden = !isOpen;
    this.button.setAttribute("aria-expanded", String(isOpen));
  }

  onKey(event) {
    const { items } = this;
    const at = items.indexOf(document.activeElement);
    const next = { Home: 0, End: items.length - 1 }[event.key] ?? (event.key in STEPS ? (at + STEPS[event.key] + items.length) % items.length : null);
    if (event.key === "Tab") this.show(false);
    else if (event.key === "Escape" && !event.defaultPrevented) this.close(); // an Escape that stopped the bench is used up
    else if (next !== null) {
      event.preventDefault();
      items[next].focus();
    }
  }
}
