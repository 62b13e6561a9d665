// What is around the display: the scene as a ghost, the viewer's eye and its way, facets' numbers.

/** The scene, translucent, in a world of its own: it shows through the display. Null where there is none. */
function makeGhost(data) {
  if (!data) return null;
  const geometry = new THREE.BufferGeometry();
  geometry.setAttribute("position", new THREE.BufferAttribute(unpack(data.position, Float32Array), 3));
  geometry.setAttribute("color", new THREE.BufferAttribute(unpack(data.color, Uint8Array), 3, true));
  geometry.setIndex(new THREE.BufferAttribute(unpack(data.triangles, Uint32Array), 1));
  geometry.computeVertexNormals();
  const look = { vertexColors: true, transparent: true, opacity: 0.25, side: THREE.DoubleSide };
  // First its depth alone, so that only what is in front of the rest of it is blended.
  const depth = new THREE.Mesh(geometry, new THREE.MeshLambertMaterial({ side: THREE.DoubleSide, colorWrite: false }));
  const world = new THREE.Scene();
  world.add(depth, new THREE.Mesh(geometry, new THREE.MeshLambertMaterial(look)), ...makeLights());
  return world;
}

function makeLights() {
  const sun = new THREE.DirectionalLight(0xffffff, 1.8);
  sun.position.set(0.4, 1, 0.7);
  return [sun, new THREE.HemisphereLight(0xffffff, 0x667080, 1.6)];
}

/** The viewer's way, with a dot at every frame of the page. */
function makePath(data) {
  const line = new THREE.BufferGeometry();
  line.setAttribute("position", new THREE.BufferAttribute(unpack(data.path, Float32Array), 3));
  const dots = new THREE.BufferGeometry().setFromPoints(data.frames.map((f) => new THREE.Vector3(...f.eye)));
  return [
    new THREE.Line(line, new THREE.LineBasicMaterial({ color: 0xb8813a })),
    new THREE.Points(dots, new THREE.PointsMaterial({ color: 0xf0a23a, size: 5, sizeAttenuation: false })),
  ];
}

/** The eye: a pyramid of lines that opens to what is looked at, as large as the frustum is 1 deep. */
function makeEye() {
  const tip = [0, 0, 0];
  const base = [[-1, -0.75, -1.4], [1, -0.75, -1.4], [1, 0.75, -1.4], [-1, 0.75, -1.4]];
  const roof = [[-0.3, 0.75, -1.4], [0, 1.15, -1.4], [0.3, 0.75, -1.4]];
  const points = [];
  base.forEach((p, k) => points.push(tip, p, p, base[(k + 1) % 4]));
  points.push(roof[0], roof[1], roof[1], roof[2]);
  const geometry = new THREE.BufferGeometry().setFromPoints(points.map((p) => new THREE.Vector3(...p)));
  return new THREE.LineSegments(geometry, new THREE.LineBasicMaterial({ color: 0xffc266 }));
}

/** Put the eye where it is in a frame, `size` metres wide. */
function placeEye(marker, frame, size) {
  const look = new THREE.Vector3(...frame.look);
  const up = new THREE.Vector3(...frame.up);
  const right = new THREE.Vector3().crossVectors(look, up);
  marker.matrixAutoUpdate = false;
  marker.matrix.makeBasis(right, up, look.negate()).scale(new THREE.Vector3(size, size, size));
  marker.matrix.setPosition(...frame.eye);
}

/** Write facets' numbers on those that turn their lit side to the camera and are large enough. */
function drawLabels(canvas, display, camera, width, height, ratio) {
  canvas.width = width * ratio;
  canvas.height = height * ratio;
  canvas.style.width = `${width}px`;
  canvas.style.height = `${height}px`;
  const pen = canvas.getContext("2d");
  pen.scale(ratio, ratio);
  pen.font = "600 12px system-ui, sans-serif";
  pen.textAlign = "center";
  pen.textBaseline = "middle";
  pen.lineWidth = 3;
  pen.strokeStyle = "rgb(0 0 0 / 80%)";
  const scale = height / (2 * Math.tan((camera.fov * Math.PI) / 360));
  const ray = new THREE.Vector3();
  const spot = new THREE.Vector3();
  display.middles.forEach(({ middle, size, normal }, f) => {
    const turned = ray.copy(camera.position).sub(middle).normalize().dot(normal);
    const facing = display.data.mesh.both ? Math.abs(turned) : turned;
    spot.copy(middle).project(camera);
    const room = (size * scale * Math.max(facing, 0)) / camera.position.distanceTo(middle);
    if (spot.z < -1 || spot.z > 1 || room < 5 + 8 * String(f + 1).length) return;
    const at = [(0.5 + 0.5 * spot.x) * width, (0.5 - 0.5 * spot.y) * height];
    const name = display.data.names[f];
    const words = name && room > 9 * name.length + 30 ? `${f + 1} ${name}` : `${f + 1}`;
    pen.fillStyle = display.lit[f] ? "#ffffff" : "#9aa0aa";
    pen.strokeText(words, ...at);
    pen.fillText(words, ...at);
  });
}
