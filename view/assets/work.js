/** The chain: a part of the folder becomes layers and a build. */

import { ask, get } from "./api.js";
import { byId, count, element } from "./format.js";

/** The panel of the work, where the viewer has a folder for it. */
export class Work {
  #fail;
  /** @type {any} what the server answered last */
  #state = null;
  #isStopping = false;
  /** @type {(() => void) | null} does what was refused, and replaces the file that is in its way */
  #replace = null;

  /** @param {(error: Error) => void} fail */
  constructor(fail) {
    this.#fail = fail;
    byId("work").hidden = false;
    byId("work-form").addEventListener("submit", (event) => {
      event.preventDefault();
      this.#order(event.submitter?.id === "work-build");
    });
    byId("work-file").addEventListener("change", () => this.#offer());
    byId("work-machine").addEventListener("change", () => this.#fitMachine());
    byId("work-turn").addEventListener("change", ({ target }) => {
      byId("work-rotate").value = target.value;
    });
    byId("work-rotate").addEventListener("input", () => (byId("work-turn").value = ""));
    byId("work-stop").addEventListener("click", () => {
      this.#isStopping = true;
      this.#say("Stopping …");
      this.#do(() => this.#send("POST", "/api/work/stop"));
    });
    byId("work-replace").addEventListener("click", () => this.#replace());
    byId("work-found").addEventListener("click", () => byId("findings").scrollIntoView());
    byId("work-pick").addEventListener("change", ({ target }) => {
      const [file] = target.files;
      target.value = "";
      if (file) this.#take(file, false);
    });
    this.#listenToDrops();
    this.#do(async () => {
      this.#show(await get("/api/work"));
      this.#restore();
      if (this.#state.job?.status === "running") await this.#wait();
    });
  }

  /** A file may be dropped anywhere on the page. */
  #listenToDrops() {
    const isFile = ({ dataTransfer }) => dataTransfer?.types.includes("Files");
    const mark = (on) => document.body.classList.toggle("dropping", on);
    addEventListener("dragover", (event) => {
      if (!isFile(event)) return;
      event.preventDefault();
      mark(true);
    });
    addEventListener("dragleave", (event) => event.relatedTarget || mark(false));
    addEventListener("drop", (event) => {
      if (!isFile(event)) return;
      event.preventDefault();
      mark(false);
      const { files } = event.dataTransfer;
      if (files.length === 1) this.#take(files[0], false);
      else this.#fail(new Error("Drop one file at a time."));
    });
  }

  /** Brings a file to the folder, and chooses it. */
  #take(file, replace) {
    return this.#do(async () => {
      this.#say(`Copying ${file.name} …`);
      const path = `/api/work/files/${encodeURIComponent(file.name)}?replace=${replace}`;
      try {
        this.#show(await this.#send("PUT", path, file));
      } finally {
        this.#say("");
      }
      byId("work-file").value = file.name;
      this.#offer();
    }, () => this.#take(file, true));
  }

  /** Orders the layers of the chosen file, or its build. */
  #order(isBuild, replace = false) {
    const text = (id) => byId(id).value.trim() || null;
    const copies = text("work-copies");
    const build = { copies: copies && Number(copies), mesh: byId("work-mesh").checked, ending: byId("work-format").value };
    const isPart = !this.#isStack();
    const order = {
      file: byId("work-file").value,
      machine: text("work-machine"),
      dpi: isPart ? text("work-dpi") : null,
      thickness: isPart ? text("work-thickness") : null,
      rotate: isPart ? text("work-rotate") : null,
      build: isBuild ? build : null,
      replace,
    };
    this.#do(async () => {
      this.#isStopping = false;
      const headers = { "content-type": "application/json" };
      this.#show(await this.#send("POST", "/api/work/make", JSON.stringify(order), headers));
      await this.#wait();
    }, () => this.#order(isBuild, true));
  }

  /** Waits for the work, and loads the page again for the stack that came of it. */
  async #wait() {
    while (this.#state.job.status === "running") {
      await new Promise((done) => setTimeout(done, 300));
      this.#show(await get("/api/work"));
    }
    if (this.#state.job.status === "ready") location.replace("/");
  }

  async #send(method, path, body, headers) {
    return (await ask(path, undefined, { method, body, headers })).json();
  }

  /** Does something that may fail. Where another file is in the way, `replace` is offered. */
  async #do(work, replace = null) {
    byId("message").hidden = true;
    byId("work-replace").hidden = true;
    try {
      await work();
    } catch (error) {
      this.#fail(error);
      this.#replace = replace;
      byId("work-replace").hidden = error.status !== 409;
    }
  }

  #say(text) {
    byId("work-state").textContent = text;
  }

  /** Shows what there is to choose from, and how the last order fares. */
  #show(state) {
    const isFirst = !this.#state;
    this.#state = state;
    const files = state.files.map(({ name, bytes }) => option(name, `${name} (${size(bytes)})`));
    fill("work-file", files.length ? files : [option("", "no part yet")]);
    if (isFirst) {
      fill("work-machine", [option("", "none: the build area of alpha"), ...state.machines.map(({ name, description }) => option(name, `${name}: ${description}`))]);
    }
    const { job } = state;
    const isRunning = job?.status === "running";
    byId("work-stop").hidden = !isRunning;
    this.#offer();
    if (!job) return;
    const share = job.of ? `: ${count(job.done)} of ${count(job.of)} layers` : " …";
    const words = {
      running: `${job.order.file}: ${job.step || "reading the part"}${share}`,
      failed: `${job.order.file}: ${job.message}`,
      stopped: `${job.order.file}: stopped. The folder is as it was.`,
      ready: job.made && `${job.made.file} is in the folder.`,
    };
    this.#say(isRunning && this.#isStopping ? "Stopping …" : (words[job.status] ?? ""));
    byId("work-state").classList.toggle("wrong", job.status === "failed");
    const { made } = job;
    byId("work-made").hidden = !made;
    if (!made) return;
    link("work-get", made.file);
    byId("work-notes").replaceChildren(...made.notes.map((note) => element("li", note)));
    byId("work-commands").hidden = !made.commands.length;
    byId("work-commands").lastElementChild.textContent = made.commands.join("\n");
  }

  /** Fills the form with the last order. */
  #restore() {
    const order = this.#state.job?.order;
    if (!order) return this.#fitMachine();
    byId("work-file").value = order.file;
    byId("work-machine").value = order.machine ?? "";
    byId("work-dpi").value = order.dpi ?? "";
    byId("work-thickness").value = order.thickness ?? "";
    byId("work-rotate").value = order.rotate ?? "";
    byId("work-turn").value = order.rotate ?? "";
    if (byId("work-turn").selectedIndex < 0) byId("work-turn").value = "";
    this.#fitMachine();
    if (order.build) {
      byId("work-copies").value = order.build.copies ?? "";
      byId("work-mesh").checked = order.build.mesh;
      byId("work-format").value = order.build.ending;
    }
    this.#offer();
  }

  #isStack() {
    return this.#state.files.some(({ name, kind }) => name === byId("work-file").value && kind === "stack");
  }

  /** Offers what can be done with the chosen file. */
  #offer() {
    const isNone = !byId("work-file").value;
    const isRunning = this.#state?.job?.status === "running";
    byId("work-slice").disabled = byId("work-build").disabled = isNone || isRunning;
    const isStack = !isNone && this.#isStack();
    byId("work-chosen").hidden = isNone;
    link("work-chosen", byId("work-file").value);
    byId("work-slice").textContent = isStack ? "Check" : "Slice and check";
    for (const field of byId("work-slicing").querySelectorAll("input, select")) field.disabled = isStack;
  }

  /** Offers the formats that the chosen machine reads, and no mesh on a panel. */
  #fitMachine() {
    const machine = this.#state.machines.find(({ name }) => name === byId("work-machine").value);
    const hasPanel = machine?.has_panel ?? false;
    byId("work-mesh").checked = !hasPanel;
    const formats = this.#state.formats.filter(({ needs_panel: needs }) => hasPanel || !needs);
    fill("work-format", formats.map(({ ending, name }) => option(ending, `.${ending}: ${name}`)));
  }
}

const option = (value, text) => Object.assign(element("option", text), { value });

/** Fills a list, and keeps what is chosen if it is still there. */
function fill(id, options) {
  const list = byId(id);
  const chosen = list.value;
  list.replaceChildren(...options);
  if (options.some(({ value }) => value === chosen)) list.value = chosen;
}

/** Lets a link download a file of the folder. */
function link(id, name) {
  byId(id).href = `/api/work/files/${encodeURIComponent(name)}`;
  byId(id).download = name;
  byId(id).textContent = `Download ${name}`;
}

/** The size of a file. */
function size(bytes) {
  const units = ["bytes", "kB", "MB", "GB", "TB"];
  const power = bytes < 1000 ? 0 : Math.min(units.length - 1, Math.floor(Math.log10(bytes) / 3));
  return `${power ? +(bytes / 1000 ** power).toPrecision(3) : bytes} ${units[power]}`;
}
