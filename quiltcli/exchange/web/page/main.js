// The page: cameras, frames, switches, keys. Settings after # in the address, such as
// #frame=4&from=aside&ghost=0&panel=0&size=640x480, say how it opens.

const at = (id) => document.getElementById(id);

function fail(message) {
  at("fault").textContent = message;
  document.title = `fault: ${message}`;
}
window.addEventListener("error", (event) => fail(event.message));
window.addEventListener("unhandledrejection", (event) => fail(String(event.reason)));

const SWITCHES = [
  { name: "labels", key: "i", words: "Facet ids", on: false },
  { name: "edges", key: "w", words: "Facet edges", on: false },
  { name: "ghost", key: "g", words: "Scene as ghost, off the eye", on: true },
  { name: "path", key: "p", words: "Viewer and path, off the eye", on: true },
  { name: "backs", key: "b", words: "Facets from behind", on: true },
  { name: "nearest", key: "n", words: "Single pixels", on: false },
  { name: "heat", key: "h", words: "Errors as heat map", on: false },
];

class Page {
  constructor(data, settings) {
    this.data = data;
    this.settings = settings;
    this.index = 0;
    this.wanted = 0;
    this.leave();
    this.display = new Display(data);
    this.images = new Images(data.frames, 4);
    this.on = this.readSwitches();
    this.makeWorld();
    this.makeCameras();
    this.makePanel();
    this.listen();
  }

  readSwitches() {
    const { data, settings } = this;
    const missing = { ghost: !data.ghost, heat: !data.frames.some((frame) => frame.heat) };
    this.switches = SWITCHES.filter(({ name }) => !missing[name]);
    // A display around the eye would hide all it shows, and the scene around it the display.
    const inside = this.display.surrounds(data.frames[0]);
    const opens = { nearest: data.nearest, backs: !inside, ghost: !inside };
    const chosen = ({ name, on }) => (settings.has(name) ? settings.get(name) !== "0" : opens[name] ?? on);
    return Object.fromEntries(this.switches.map((each) => [each.name, chosen(each)]));
  }

  makeWorld() {
    const { data, display } = this;
    this.renderer = new THREE.WebGLRenderer({ canvas: at("view"), antialias: true });
    const [surround] = data.greys;
    this.renderer.setClearColor(`rgb(${surround.join(",")})`);
    this.scene = new THREE.Scene();
    this.ghost = makeGhost(data.ghost);
    this.eye = makeEye();
    this.around = [...makePath(data), this.eye];
    this.renderer.autoClear = false;
    this.scene.add(...display.meshes, display.edges, ...this.around);
  }

  makeCameras() {
    const size = this.data.radius;
    this.camera = new THREE.PerspectiveCamera(45, 4 / 3, 0.003 * size, 300 * size);
    this.heatCamera = new THREE.PerspectiveCamera(45, this.data.aspect, 0.01, 100);
    this.controls = new THREE.OrbitControls(this.camera, at("view"));
    this.controls.addEventListener("start", () => this.leaveEye());
    this.controls.addEventListener("change", () => this.draw());
  }

  makePanel() {
    at("name").textContent = this.data.display;
    at("frames").hidden = this.data.frames.length < 2;
    at("frames").style.display = this.data.frames.length < 2 ? "none" : "";
    at("slider").max = this.data.frames.length - 1;
    if (this.settings.get("panel") === "0") at("panel").style.display = "none";
    at("panel").classList.toggle("folded", window.innerWidth < 600);
    for (const { name, key, words } of this.switches) {
      const label = document.createElement("label");
      const box = document.createElement("input");
      const hint = document.createElement("kbd");
      box.type = "checkbox";
      box.checked = this.on[name];
      box.addEventListener("change", () => this.set(name, box.checked));
      hint.textContent = key.toUpperCase();
      label.append(box, words, hint);
      label.dataset.name = name;
      at("switches").append(label);
    }
  }

  listen() {
    const keys = {
      e: () => this.goToEye(), a: () => this.goAside(), u: () => this.fold(),
      ArrowLeft: () => this.goTo(this.wanted - 1), ArrowRight: () => this.goTo(this.wanted + 1),
      " ": () => this.play(),
    };
    for (const { name, key } of this.switches) keys[key] = () => this.set(name, !this.on[name]);
    window.addEventListener("keydown", (event) => {
      const key = event.key.length === 1 ? event.key.toLowerCase() : event.key;
      const typed = event.ctrlKey || event.metaKey || event.altKey || !Object.hasOwn(keys, key);
      if (typed || (event.target.tagName === "BUTTON" && key === " ")) return;
      event.preventDefault();
      keys[key]();
    });
    at("eye").addEventListener("click", () => this.goToEye());
    at("aside").addEventListener("click", () => this.goAside());
    at("fold").addEventListener("click", () => this.fold());
    at("play").addEventListener("click", () => this.play());
    at("slider").addEventListener("input", () => this.goTo(Number(at("slider").value)));
    at("view").addEventListener("pointermove", (event) => this.point(event));
    at("view").addEventListener("pointerleave", () => { at("tip").style.display = "none"; });
    window.addEventListener("resize", () => this.resize());
  }

  get frame() { return this.data.frames[this.index]; }

  set(name, on) {
    this.on[name] = on;
    document.querySelector(`#switches [data-name="${name}"] input`).checked = on;
    if (name === "nearest") this.images.setNearest(on).then(() => this.draw());
    this.draw();
  }

  /** As large as the window, or as the settings say. */
  resize() {
    const asked = /^(\d+)x(\d+)$/.exec(this.settings.get("size") || "");
    this.width = asked ? Number(asked[1]) : window.innerWidth;
    this.height = asked ? Number(asked[2]) : window.innerHeight;
    this.ratio = Math.min(window.devicePixelRatio || 1, 2);
    this.renderer.setPixelRatio(this.ratio);
    this.renderer.setSize(this.width, this.height);
    this.fitLens();
    if (this.atEye) this.goToEye();
    if (this.fromAside) this.goAside();
    this.draw();
  }

  /** What is looked at stands in the middle of the room that the panel leaves. */
  fitLens() {
    const panel = at("panel");
    const open = panel.style.display !== "none" && !panel.classList.contains("folded");
    const taken = open && this.width > 760 ? panel.offsetLeft + panel.offsetWidth : 0;
    this.aspect = (this.width - taken) / this.height;
    this.camera.setViewOffset(this.width - taken, this.height, -taken, 0, this.width, this.height);
    this.camera.aspect = this.aspect;
    this.camera.updateProjectionMatrix();
  }

  fold() {
    at("panel").classList.toggle("folded");
    this.resize();
  }

  /** Show a frame once its images are there; the last one that was asked for wins. */
  async goTo(index) {
    this.wanted = Math.min(Math.max(index, 0), this.data.frames.length - 1);
    const mine = this.wanted;
    const textures = await this.images.of(mine);
    if (mine !== this.wanted) return;
    this.index = mine;
    this.display.show(this.frame, textures);
    this.aim(this.heatCamera, this.frame, this.data.aspect);
    this.display.heatSeenFrom(this.heatCamera);
    placeEye(this.eye, this.frame, 0.09 * this.data.radius);
    at("slider").value = mine;
    at("number").textContent = this.frame.frame;
    at("name").textContent = `${this.data.display} · frame ${this.frame.frame}`;
    document.title = at("name").textContent;
    this.tellFigures();
    if (this.atEye) this.goToEye();
    this.draw();
    if (mine + 1 < this.data.frames.length && this.timer) this.images.of(mine + 1);
  }

  tellFigures() {
    at("figures").replaceChildren(...this.frame.figures.flatMap(([label, text]) => {
      const [term, value] = [document.createElement("dt"), document.createElement("dd")];
      term.textContent = label;
      value.textContent = text;
      return [term, value];
    }));
  }

  play() {
    at("play").textContent = this.timer ? "▶" : "⏸";
    if (this.timer) {
      window.clearInterval(this.timer);
      this.timer = 0;
      return;
    }
    this.timer = window.setInterval(() => {
      if (this.wanted === this.index) this.goTo((this.index + 1) % this.data.frames.length);
    }, 1000 / this.data.fps);
  }

  /** Put a camera at a frame's eye, so that it shows the whole display in a picture of any shape. */
  aim(camera, frame, aspect) {
    const { look, up, fov } = frame.camera;
    const reach = Math.tan((fov * Math.PI) / 360) * Math.max(1, this.data.aspect / aspect);
    camera.fov = (Math.atan(reach) * 360) / Math.PI;
    camera.aspect = aspect;
    camera.up.set(...up);
    camera.position.set(...frame.eye);
    camera.lookAt(new THREE.Vector3(...look).add(camera.position));
    camera.updateProjectionMatrix();
    camera.updateMatrixWorld();
  }

  goToEye() {
    this.leave();
    this.atEye = true;
    this.aim(this.camera, this.frame, this.aspect);
    // Turning starts from here, about the point ahead that is as far as the display's middle.
    const look = new THREE.Vector3(...this.frame.camera.look);
    const ahead = -this.camera.position.dot(look);
    const reach = Math.max(ahead, 0.3 * this.data.radius);
    this.controls.target.copy(this.camera.position).addScaledVector(look, reach);
    this.draw();
  }

  /** From here on the camera stays where it is put. */
  leave() {
    this.atEye = this.fromAside = false;
  }

  leaveEye() {
    this.fromAside = false;
    if (!this.atEye) return;
    this.leave();
    this.camera.up.set(0, 1, 0);
    this.draw();
  }

  /** Look from aside at the display and the eye together. */
  goAside() {
    this.leave();
    this.fromAside = true;
    const { camera, display } = this;
    const eye = new THREE.Vector3(...this.frame.eye);
    const points = [eye, ...display.points()];
    const middle = eye.clone().multiplyScalar(0.4);
    const back = new THREE.Vector3(eye.x, 0, eye.z);
    if (back.length() < 0.05 * this.data.radius) back.set(0, 0, 1);
    back.normalize().applyAxisAngle(new THREE.Vector3(0, 1, 0), -1.1).setY(0.6).normalize();
    const right = new THREE.Vector3(back.z, 0, -back.x).normalize();
    const up = new THREE.Vector3().crossVectors(back, right);
    camera.fov = 40;
    const tall = Math.tan((camera.fov * Math.PI) / 360) / 1.15;
    const distances = points.map((point) => {
      const away = point.clone().sub(middle);
      const across = Math.abs(away.dot(right)) / this.aspect;
      return away.dot(back) + Math.max(across, Math.abs(away.dot(up))) / tall;
    });
    camera.up.set(0, 1, 0);
    camera.position.copy(middle).addScaledVector(back, Math.max(...distances, 1.5 * this.data.radius));
    camera.updateProjectionMatrix();
    this.controls.target.copy(middle);
    this.controls.update();
    this.draw();
  }

  /** Nine numbers of the world, metres: place, look, up; then degrees from top to bottom. */
  goToCamera(numbers) {
    const [place, look, up] = [0, 3, 6].map((k) => new THREE.Vector3(...numbers.slice(k, k + 3)));
    this.leave();
    this.camera.position.copy(place).sub(new THREE.Vector3(...this.data.centre));
    this.camera.up.copy(up);
    this.camera.fov = numbers[9];
    this.camera.lookAt(look.add(this.camera.position));
    this.camera.updateProjectionMatrix();
    this.draw();
  }

  open() {
    const numbers = (this.settings.get("camera") || "").split(",").map(Number);
    if (numbers.length === 10 && numbers.every(Number.isFinite)) this.goToCamera(numbers);
    else if (this.settings.get("from") === "aside") this.goAside();
    else this.goToEye();
  }

  tellPlace() {
    const eye = new THREE.Vector3(...this.frame.eye);
    const away = this.camera.position.distanceTo(eye);
    at("place").classList.toggle("holds", this.atEye);
    at("place").textContent = this.atEye
      ? "At the viewer’s eye: the picture holds."
      : `${away < 1 ? `${(100 * away).toFixed(0)} cm` : `${away.toFixed(2)} m`} from the viewer’s eye: the picture is bent.`;
  }

  /** Name the facet under the pointer. */
  point(event) {
    const tip = at("tip");
    const where = new THREE.Vector2((2 * event.clientX) / this.width - 1, 1 - (2 * event.clientY) / this.height);
    const ray = new THREE.Raycaster();
    ray.setFromCamera(where, this.camera);
    const facet = (hit) => this.display.cornerFacet[hit.face.a];
    const hits = event.buttons ? [] : ray.intersectObjects(this.display.meshes, false);
    const hit = hits.find((each) => this.display.drawnFrom(facet(each), this.camera.position));
    tip.style.display = hit ? "block" : "none";
    if (!hit) return;
    tip.textContent = this.display.describe(facet(hit));
    tip.style.left = `${Math.min(event.clientX + 14, window.innerWidth - tip.offsetWidth - 8)}px`;
    tip.style.top = `${Math.min(event.clientY + 14, window.innerHeight - tip.offsetHeight - 8)}px`;
  }

  /** Draw before the browser shows its next picture, once however often it was asked for. */
  draw() {
    if (this.asked) return;
    this.asked = window.requestAnimationFrame(() => this.drawNow());
  }

  drawNow() {
    this.asked = 0;
    const off = !this.atEye;
    for (const thing of this.around) thing.visible = off && this.on.path;
    this.display.edges.visible = this.on.edges;
    this.display.set(this.on.heat && this.frame.heat, this.on.backs);
    this.renderer.clear();
    this.renderer.render(this.scene, this.camera);
    if (this.ghost && off && this.on.ghost) {
      this.renderer.clearDepth();
      this.renderer.render(this.ghost, this.camera);
    }
    at("labels").style.display = this.on.labels ? "block" : "none";
    if (this.on.labels) drawLabels(at("labels"), this.display, this.camera, this.width, this.height, this.ratio);
    this.tellPlace();
  }
}

async function main() {
  const data = JSON.parse(at("data").textContent);
  const settings = new URLSearchParams(window.location.hash.slice(1));
  let page;
  try {
    page = new Page(data, settings);
  } catch (error) {
    fail(`The page cannot draw here; it needs WebGL 2 (${error.message})`);
    return;
  }
  await page.images.setNearest(page.on.nearest || false);
  const wanted = data.frames.findIndex((frame) => String(frame.frame) === settings.get("frame"));
  page.resize();
  await page.goTo(Math.max(wanted, 0));
  page.open();
  page.drawNow();
  // A program that waits for the picture looks at the title.
  if (settings.has("test")) document.title = `ready ${page.display.count}`;
}
main();
