// The same town drawn by three.js with a shadow map of 2048².

const text = (id) => document.getElementById(id).textContent;
const data = JSON.parse(text("data"));
const packed = Uint8Array.from(atob(text("library")), (letter) => letter.charCodeAt(0));
const library = new TextDecoder().decode(packed);
const source = new Blob([library], { type: "text/javascript" });
const THREE = await import(URL.createObjectURL(source));
const canvas = document.getElementById("c"), [wide, high] = data.size, { side } = data;
const renderer = new THREE.WebGLRenderer({ canvas, antialias: true });
renderer.setSize(wide, high);
renderer.shadowMap.enabled = true;
const scene = new THREE.Scene(), camera = new THREE.PerspectiveCamera(45, wide / high, 1, 8 * side);
scene.background = new THREE.Color(0xc0d0e0);
camera.up.set(0, 0, 1);
camera.position.set(...data.eye);
camera.lookAt(0, 0, 0);
const shared = new THREE.BufferGeometry();
shared.setAttribute("position", new THREE.Float32BufferAttribute(data.vertices, 3));
shared.setIndex(data.faces);
const geometry = shared.toNonIndexed();
geometry.computeVertexNormals();
const town = new THREE.Mesh(geometry, new THREE.MeshLambertMaterial({ color: 0xbbbbbb }));
const ground = new THREE.Mesh(new THREE.PlaneGeometry(20 * side, 20 * side),
  new THREE.MeshLambertMaterial({ color: 0x888888 }));
town.castShadow = town.receiveShadow = ground.receiveShadow = true;
const sun = new THREE.DirectionalLight(0xffffff, 2), far = 0.75 * side;
sun.castShadow = true;
sun.shadow.mapSize.set(2048, 2048);
Object.assign(sun.shadow.camera, { left: -far, right: far, top: far, bottom: -far, near: 1, far: 4 * side });
scene.add(town, ground, sun, new THREE.HemisphereLight(0xd0e0ff, 0x807060, 1));
globalThis.gl = renderer.getContext();
let tick = 0;
globalThis.draw = () => {
  const turn = 0.6 + 0.004 * tick++;
  sun.position.set(0.7 * Math.cos(turn), 0.7 * Math.sin(turn), 0.6).multiplyScalar(2 * side);
  renderer.render(scene, camera);
};
frames(1);
globalThis.ready = true;
