// Code by which another device signs in as the same person: as digits and as a QR code, with its remaining time.

import { post } from "../common/api.js";
import { Countdown } from "./countdown.js";
import { openDialog } from "../common/dialogs.js";
import { byId, duration, write } from "../common/format.js";

export class DeviceCode {
  constructor() {
    this.time = new Countdown({
      onTick: (left) => write(byId("device-time"), `Valid for ${duration(left)}, and for one sign-in.`),
      onEnd: () => this.clear("This code is no longer valid."),
    });
    byId("device-again").addEventListener("click", () => this.request());
    byId("device-dialog").addEventListener("close", () => {
      this.time.end();
      this.clear("");
    });
  }

  open() {
    openDialog("device-dialog");
    byId("device-again").focus();
    return this.request();
  }

  async request() {
    this.time.end();
    this.clear("The code is made …");
    try {
      const made = await post("session/codes");
      if (byId("device-dialog").open) this.show(made);
    } catch (problem) {
      this.clear(problem.after("There is no code"));
    }
  }

  show({ code, svg, url, expires_in_s: left }) {
    write(byId("device-code"), code);
    write(byId("device-address"), new URL(url).origin);
    byId("device-picture").src = `data:image/svg+xml,${encodeURIComponent(svg)}`; // as a picture, it cannot contain scripts
    byId("device-made").hidden = false;
    write(byId("device-note"), "");
    this.time.begin(left);
  }

  clear(text) {
    byId("device-made").hidden = true;
    byId("device-picture").removeAttribute("src");
    for (const id of ["device-code", "device-time"]) write(byId(id), "");
    write(byId("device-note"), text);
  }
}
