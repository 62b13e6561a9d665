"use strict";
// The display: facets that show their images on the lit side, and are grey from behind.

/** A typed array from base64. */
function unpack(text, kind) {
  const raw = atob(text);
  const bytes = new Uint8Array(raw.length);
  for (let i = 0; i < raw.length; i += 1) bytes[i] = raw.charCodeAt(i);
  return new kind(bytes.buffer);
}

const VERTEX = `
attribute vec2 quilt;
attribute vec3 facing;
attribute float lit;
centroid varying vec2 place;
varying vec2 evenPlace;
varying vec3 normalOut;
varying vec3 world;
varying float shows;
void main() {
  place = evenPlace = quilt;
  normalOut = mat3(modelMatrix) * facing;
  world = (modelMatrix * vec4(position, 1.0)).xyz;
  shows = lit;
  gl_Position = projectionMatrix * viewMatrix * vec4(world, 1.0);
}`;

// Four looks a pixel, spread over it: images are mostly finer than the screen. None of them leaves the
// facet by more than its bleed: pixels at an edge are looked up inside it, and not too far around.
const FRAGMENT = `
uniform sampler2D image;
uniform sampler2D heat;
uniform vec2 span;
uniform float both;
uniform float hot;
uniform float backs;
uniform float bent;
uniform vec3 shownTo;
uniform mat4 heatFrom;
uniform vec3 edgeOn;
uniform vec3 faceOn;
centroid varying vec2 place;
varying vec2 evenPlace;
varying vec3 normalOut;
varying vec3 world;
varying float shows;
vec3 look(vec2 at) { return texture2D(image, at / span).rgb; }
void main() {
  vec2 dx = dFdx(evenPlace) * 0.25;
  vec2 dy = dFdy(evenPlace) * 0.25;
  float fits = min(1.0, 1.5 / (length(dx) + length(dy) + 1e-9));
  dx *= fits;
  dy *= fits;
  vec3 outward = bent > 0.5 ? normalize(normalOut) : normalOut;
  float turned = dot(outward, normalize(world - cameraPosition));
  // A curved facet is dark where its own lit side faces away from the eye, place by place.
  bool on = shows > 0.5 && (bent < 0.5 || both > 0.5 || dot(outward, shownTo - world) > 0.0);
  if (backs < 0.5 && both < 0.5 && turned > 0.0) discard;
  vec3 color = mix(edgeOn, faceOn, abs(turned));
  if (on && (both > 0.5 || turned < 0.0)) {
    color = 0.25 * (look(place + dx + dy) + look(place + dx - dy) + look(place - dx + dy) + look(place - dx - dy));
    if (hot > 0.5) {
      vec4 seen = heatFrom * vec4(world, 1.0);
      vec2 at = 0.5 + 0.5 * seen.xy / seen.w;
      bool known = seen.w > 0.0 && all(greaterThan(at, vec2(0.0))) && all(lessThan(at, vec2(1.0)));
      vec3 error = known ? texture2D(heat, vec2(at.x, 1.0 - at.y)).rgb : vec3(0.0);
      color = error + 0.08 * dot(color, vec3(0.2126, 0.7152, 0.0722));
    }
  }
  gl_FragColor = vec4(color, 1.0);
  #include <colorspace_fragment>
}`;

/** Linear light of 8-bit display values. */
function linear(bytes) {
  const curve = (v) => (v <= 0.04045 ? v / 12.92 : ((v + 0.055) / 1.055) ** 2.4);
  return new THREE.Vector3(...bytes.map((v) => curve(v / 255)));
}

class Display {
  constructor(data) {
    const mesh = data.mesh;
    this.data = data;
    this.start = unpack(mesh.start, Uint32Array);
    this.position = unpack(mesh.position, Float32Array);
    this.normal = unpack(mesh.normal, Float32Array);
    this.page = unpack(mesh.page, Int32Array);
    this.count = this.page.length;
    this.corners = this.position.length / 3;
    this.cornerFacet = new Uint32Array(this.corners);
    for (let f = 0; f < this.count; f += 1) this.cornerFacet.fill(f, this.start[f], this.start[f + 1]);
    this.bent = mesh.bent ? unpack(mesh.bent, Uint8Array) : new Uint8Array(this.count);
    this.curved = this.bent.some((bent) => bent);
    this.lit = new Uint8Array(this.count);
    this.carried = new THREE.Matrix4();  // a projection goes along with the eye
    this.shared = this.attributes(unpack(mesh.quilt, Float32Array));
    const [, edgeOn, faceOn] = data.greys.map(linear);
    this.uniforms = {
      both: { value: mesh.both ? 1 : 0 }, hot: { value: 0 }, backs: { value: 1 }, heat: { value: null },
      bent: { value: this.curved ? 1 : 0 }, shownTo: { value: new THREE.Vector3() },
      heatFrom: { value: new THREE.Matrix4() }, edgeOn: { value: edgeOn }, faceOn: { value: faceOn },
    };
    this.meshes = this.makeMeshes(unpack(mesh.triangles, Uint32Array), unpack(mesh.facet, Uint32Array));
    this.edges = this.makeEdges();
    this.middles = this.makeMiddles();
  }

  attributes(quilt) {
    const given = this.data.mesh.facing;
    const facing = given ? unpack(given, Float32Array) : new Float32Array(this.corners * 3);
    for (let c = 0; !given && c < this.corners; c += 1) {
      const f = this.cornerFacet[c];
      facing.set(this.normal.subarray(3 * f, 3 * f + 3), 3 * c);
    }
    return {
      position: new THREE.BufferAttribute(this.position, 3),
      quilt: new THREE.BufferAttribute(quilt, 2),
      facing: new THREE.BufferAttribute(facing, 3),
      lit: new THREE.BufferAttribute(new Float32Array(this.corners), 1),
    };
  }

  /** One mesh a page, and one for facets that have none. */
  makeMeshes(triangles, facet) {
    const lists = new Map();
    facet.forEach((f, t) => {
      const page = this.page[f];
      if (!lists.has(page)) lists.set(page, []);
      lists.get(page).push(...triangles.subarray(3 * t, 3 * t + 3));
    });
    return [...lists].map(([page, indices]) => {
      const geometry = new THREE.BufferGeometry();
      for (const [name, attribute] of Object.entries(this.shared)) geometry.setAttribute(name, attribute);
      geometry.setIndex(new THREE.BufferAttribute(new Uint32Array(indices), 1));
      const span = page < 0 ? [1, 1] : this.data.pages[page];
      const material = new THREE.ShaderMaterial({
        uniforms: { ...this.uniforms, image: { value: null }, span: { value: new THREE.Vector2(...span) } },
        vertexShader: VERTEX, fragmentShader: FRAGMENT, side: THREE.DoubleSide,
        polygonOffset: true, polygonOffsetFactor: 1, polygonOffsetUnits: 1,
      });
      const mesh = new THREE.Mesh(geometry, material);
      mesh.frustumCulled = false;
      mesh.userData.page = page;
      return mesh;
    });
  }

  makeEdges() {
    const pairs = this.curved ? [...unpack(this.data.mesh.edges, Uint32Array)] : [];
    for (let f = 0; !this.curved && f < this.count; f += 1) {
      const [from, to] = [this.start[f], this.start[f + 1]];
      for (let c = from; c < to; c += 1) pairs.push(c, c + 1 < to ? c + 1 : from);
    }
    const geometry = new THREE.BufferGeometry();
    geometry.setAttribute("position", this.shared.position);
    geometry.setIndex(pairs);
    return new THREE.LineSegments(geometry, new THREE.LineBasicMaterial({ color: 0x9fb4cc }));
  }

  /** The middle of every facet, and its size: where a label goes and whether there is room for one. */
  makeMiddles() {
    return Array.from({ length: this.count }, (_, f) => {
      const corners = [];
      for (let c = this.start[f]; c < this.start[f + 1]; c += 1) {
        corners.push(new THREE.Vector3().fromArray(this.position, 3 * c));
      }
      const middle = corners.reduce((sum, p) => sum.add(p), new THREE.Vector3()).divideScalar(corners.length);
      const size = 2 * corners.reduce((sum, p) => sum + p.distanceTo(middle), 0) / corners.length;
      return { middle, size, normal: new THREE.Vector3().fromArray(this.normal, 3 * f) };
    });
  }

  /** Show a frame's images; `textures` are those of its pages. */
  show(frame, textures) {
    this.lit = unpack(frame.lit, Uint8Array);
    this.uniforms.shownTo.value.fromArray(frame.eye);
    this.carried.fromArray(frame.carried || new THREE.Matrix4().elements);
    for (const part of [...this.meshes, this.edges]) {
      part.matrixAutoUpdate = false;
      part.matrix.copy(this.carried);
      part.matrixWorldNeedsUpdate = true;
    }
    const lit = this.shared.lit;
    for (let c = 0; c < this.corners; c += 1) lit.array[c] = this.lit[this.cornerFacet[c]];
    lit.needsUpdate = true;
    for (const mesh of this.meshes) {
      mesh.material.uniforms.image.value = mesh.userData.page < 0 ? null : textures.pages[mesh.userData.page];
      mesh.material.uniforms.heat.value = textures.heat;
    }
  }

  /** Where the heat map was taken: at the eye of a frame. */
  heatSeenFrom(camera) {
    this.uniforms.heatFrom.value.multiplyMatrices(camera.projectionMatrix, camera.matrixWorldInverse);
  }

  /** Show errors instead of images; show facets from behind, or look through them. */
  set(hot, backs) {
    this.uniforms.hot.value = hot ? 1 : 0;
    this.uniforms.backs.value = backs ? 1 : 0;
  }

  /** Whether a facet is drawn as seen from a place. */
  drawnFrom(f, place) {
    const { middle, normal } = this.middles[f];
    if (this.bent[f]) return true;
    return this.uniforms.backs.value > 0 || this.data.mesh.both || place.clone().sub(middle).dot(normal) > 0;
  }

  /** Whether the display is around an eye, so that a part of it lies behind. */
  surrounds(frame) {
    const [eye, look] = [new THREE.Vector3(...frame.eye), new THREE.Vector3(...frame.camera.look)];
    return this.points().some((corner) => corner.sub(eye).dot(look) <= 0);
  }

  points() {
    return Array.from({ length: this.corners }, (_, c) => (
      new THREE.Vector3().fromArray(this.position, 3 * c).applyMatrix4(this.carried)
    ));
  }

  describe(f) {
    const words = [`facet ${f + 1}`];
    if (this.data.names[f]) words.push(this.data.names[f]);
    words.push(`${this.data.sizes[f][0]} × ${this.data.sizes[f][1]} pixels`);
    if (this.data.pages.length > 1 && this.page[f] >= 0) words.push(`page ${this.page[f] + 1}`);
    if (!this.lit[f]) words.push("dark for this eye");
    return words.join(" · ");
  }
}

/** Textures of frames, made when they are first shown; the last few are kept. */
class Images {
  constructor(frames, most) {
    this.frames = frames;
    this.most = most;
    this.kept = new Map();
    this.nearest = false;
  }

  /** A promise of {pages, heat}. */
  of(index) {
    const found = this.kept.get(index) || this.load(this.frames[index]);
    this.kept.delete(index);
    this.kept.set(index, found);
    for (const [old, promise] of this.kept) {
      if (this.kept.size <= this.most) break;
      this.kept.delete(old);
      promise.then((gone) => [...gone.pages, gone.heat].forEach((texture) => texture && texture.dispose()));
    }
    return found;
  }

  async load(frame) {
    const pages = await Promise.all(frame.pages.map((url) => this.texture(url)));
    pages.forEach((texture) => this.filter(texture));
    return { pages, heat: frame.heat ? await this.texture(frame.heat) : null };
  }

  async texture(url) {
    const image = new Image();
    image.src = url;
    await image.decode();
    const texture = new THREE.Texture(image);
    texture.colorSpace = THREE.SRGBColorSpace;
    texture.flipY = false;
    texture.generateMipmaps = false;
    texture.minFilter = texture.magFilter = THREE.LinearFilter;
    texture.needsUpdate = true;
    return texture;
  }

  filter(texture) {
    texture.minFilter = texture.magFilter = this.nearest ? THREE.NearestFilter : THREE.LinearFilter;
    texture.needsUpdate = true;
  }

  /** Show pixels as squares, or go between them. */
  async setNearest(on) {
    this.nearest = on;
    for (const promise of this.kept.values()) (await promise).pages.forEach((texture) => this.filter(texture));
  }
}
