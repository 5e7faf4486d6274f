// Draws the arena, and passes the user's input to Python (web_arena.py), which simulates everything.

import * as THREE from 'three';
import { OrbitControls } from 'three/examples/jsm/controls/OrbitControls.js';
import { loadPyodide } from 'pyodide';
import URDFLoader from 'urdf-loader';

const form = $('form');

async function loadPython() {
  const files = Object.entries(JSON.parse($('libraries').textContent).integrity);
  const write = chunk => { $('progress').value += chunk.length; };
  // This code checks one download of the files. Pyodide loads them again, without a check, usually
  // from the browser's cache.
  await Promise.all(files.filter(([url]) => url.includes('pyodide')).map(async ([url, integrity]) => {
    const response = await fetch(url, { integrity }).catch(() => null);
    if (!response?.ok) throw new Error(missing(url));
    await response.body.pipeTo(new WritableStream({ write }));
  }));
  const python = await loadPyodide();
  const modules = await fetch('turtle_brick.zip');
  python.unpackArchive(await modules.arrayBuffer(), 'zip');
  return python;
}

function makeScene({ size, brick, wall }) {
  const scene = new THREE.Scene();
  const add = (geometry, color, x, y, z, options) => {
    const mesh = new THREE.Mesh(geometry, new THREE.MeshLambertMaterial({ color, ...options }));
    mesh.position.set(x, y, z);
    return scene.add(mesh) && mesh;
  };
  const middle = size / 2, glass = { transparent: true, opacity: 0.5 };
  const sun = new THREE.DirectionalLight('white', 1);
  sun.position.set(3, -6, 12);
  const grid = new THREE.GridHelper(size, 11, 'silver', 'silver').rotateX(Math.PI / 2);
  grid.position.set(middle, middle, 0.002);
  scene.add(new THREE.HemisphereLight('white', 'silver', 2.4), sun, grid);
  for (const end of [0, size]) {
    add(new THREE.BoxGeometry(size, 0.1, wall), 'lightslategray', middle, end, wall / 2, glass);
    add(new THREE.BoxGeometry(0.1, size, wall), 'lightslategray', end, middle, wall / 2, glass);
  }
  const inside = [[1, 0, 0], [-1, 0, size], [0, 1, 0], [0, -1, size]].map(
    ([x, y, constant]) => new THREE.Plane(new THREE.Vector3(x, y, 0), constant));
  return {
    scene, ground: add(new THREE.PlaneGeometry(size, size), '#dfe6ec', middle, middle, 0),
    disc: add(new THREE.CircleGeometry(1, 96), 'limegreen', 0, 0, 0.004, { ...glass, clippingPlanes: inside }),
    brick: add(new THREE.BoxGeometry(...brick), '#c1440e', 0, 0, 0),
    line: add(new THREE.CylinderGeometry(0.01, 0.01, 1).rotateX(Math.PI / 2), '#c1440e', 0, 0, 0),
  };
}

async function start() {
  if (!window.WebAssembly) throw new Error('this browser has no WebAssembly');
  if (!document.createElement('canvas').getContext('webgl2')) throw new Error('this browser has no WebGL 2');
  THREE.Object3D.DEFAULT_UP.set(0, 0, 1);
  THREE.ColorManagement.enabled = false;
  const python = window.python = await loadPython();
  const arena = window.arena = python.runPython('from web_arena import WebArena\nWebArena()');
  const constants = JSON.parse(arena.constants());
  const { scene, ground, disc, brick, line } = makeScene(constants);
  const view = $('view');
  const renderer = new THREE.WebGLRenderer({ canvas: view, antialias: true, alpha: true });
  renderer.localClippingEnabled = true;
  renderer.outputColorSpace = THREE.LinearSRGBColorSpace;
  renderer.setPixelRatio(Math.min(devicePixelRatio, 2));
  const camera = new THREE.PerspectiveCamera(45, view.clientWidth / view.clientHeight, 0.1, 200);
  const middle = constants.size / 2, ends = [0, constants.size];
  const corners = ends.flatMap(x => ends.flatMap(y => [0, constants.height].map(
    z => new THREE.Vector3(x, y, z))));
  const isVisible = corner => {
    const { x, y } = corner.clone().project(camera);
    return Math.abs(x) < 0.97 && Math.abs(y) < 0.97;
  };
  const orbit = new OrbitControls(camera, view);
  orbit.target.set(middle, middle, 3);
  // Move the camera away until the highest brick is visible in each corner of the arena.
  for (let away = 1; away < 9 && !corners.every(isVisible); away += 0.02) {
    camera.position.set(3, -16, 7).multiplyScalar(away).add(orbit.target);
    orbit.update();
    camera.updateMatrixWorld();
  }
  orbit.listenToKeyEvents(view);
  new ResizeObserver(() => {
    camera.aspect = view.clientWidth / view.clientHeight;
    camera.updateProjectionMatrix();
    renderer.setSize(view.clientWidth, view.clientHeight, false);
  }).observe(view);

  // The form contains all settings. The address can contain these settings, too.
  $('sliders').innerHTML = constants.sliders.map(([name, label, lower, upper, value]) => `<label>${label}<span>
    <input type="range" name="${name}" min="${lower}" max="${upper}" step="any" value="${value}">
    <output></output></span></label>`).join('');
  const call = (...input) => { $('error').textContent = arena.call(...input); };
  let urdf, robot;
  const update = address => {
    call('update', JSON.stringify({ ...Object.fromEntries(new FormData(form)), ...address }));
    const settings = JSON.parse(arena.settings());  // After a refusal, these are the previous values.
    for (const slider of form.querySelectorAll('[type=range]')) {
      slider.value = settings[slider.name];
      slider.nextElementSibling.value = Number(slider.value).toFixed(2);
    }
    if (urdf === arena.urdf) return;
    urdf = arena.urdf;
    scene.remove(robot);
    robot = new URDFLoader().parse(urdf);
    scene.add(robot);
  };
  const readAddress = () => {
    const settings = Object.fromEntries(new URLSearchParams(location.hash.slice(1)));
    const unknown = Object.keys(settings).filter(name => !form.elements[name]);
    if (unknown.length) {
      $('error').textContent = `unknown settings in the address: ${unknown.join(', ')}`;
      return;
    }
    // An address names only those boxes that are checked.
    if (location.hash.length > 1) {
      for (const box of form.querySelectorAll('[type=checkbox]')) box.checked = box.name in settings;
    }
    for (const [name, value] of Object.entries(settings)) {
      const field = form.elements[name];
      if ([...field.options ?? []].some(option => option.value === value)) field.value = value;
    }
    update(settings);
  };
  form.addEventListener('input', () => update());
  addEventListener('hashchange', readAddress);
  form.addEventListener('submit', event => {
    event.preventDefault();
    call('drop');
  });
  $('copy').addEventListener('click', () => {
    location.hash = new URLSearchParams(new FormData(form));
    navigator.clipboard?.writeText(location.href).then(() => { $('copy').textContent = 'Link copied'; });
  });
  let pressed;
  view.addEventListener('pointerdown', event => { pressed = event; });
  view.addEventListener('pointerup', ({ clientX, clientY, offsetX, offsetY }) => {
    if (!pressed || Math.hypot(clientX - pressed.clientX, clientY - pressed.clientY) > 6) return;
    const ray = new THREE.Raycaster();
    ray.setFromCamera(new THREE.Vector2(2 * offsetX / view.clientWidth - 1,
                                        1 - 2 * offsetY / view.clientHeight), camera);
    for (const { point } of ray.intersectObject(ground)) {
      if (form.mode.value === 'drive') return arena.simulation.drive_to(point.x, point.y);
      [form.x.value, form.y.value] = [point.x, point.y];
      update();
    }
  });

  let last = performance.now();
  const draw = now => {
    const state = JSON.parse(arena.advance(Math.min((now - last) / 1000, 0.25) * form.speed.value));
    last = now;
    const [x, y, yaw] = state.robot;
    robot.position.set(x, y, 0);
    robot.rotation.z = yaw;
    robot.setJointValues(state.joints);
    brick.position.set(...state.brick);
    brick.quaternion.set(...state.orientation);
    line.position.set(state.brick[0], state.brick[1], state.brick[2] / 2);
    line.scale.z = state.brick[2];
    disc.position.set(x, y, 0.004);
    disc.scale.setScalar(Math.max(state.guaranteed, 0.001));
    orbit.update();
    renderer.render(scene, camera);
    for (const [id, text] of Object.entries(state.texts)) {
      if ($(id).textContent !== text) $(id).textContent = text;
    }
    requestAnimationFrame(draw);
  };
  update();
  readAddress();
  draw(last);
  setInterval(() => { $('plots').innerHTML = arena.plots(); }, 200);
  $('loading').hidden = true;
}

start().catch(error => fail(`The page cannot start: ${error.message}`));
