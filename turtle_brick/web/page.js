// Draws the arena, and passes the user's input to Python (web_arena.py), which simulates everything.

import * as THREE from 'three';
import { OrbitControls } from 'orbit';
import { loadPyodide } from 'pyodide';

const $ = id => document.getElementById(id);
const form = $('form');

async function loadPython() {
  const files = JSON.parse($('files').textContent);
  const total = files.reduce((sum, file) => sum + file.size, 0);
  let loaded = 0;
  // This checks the files. Pyodide then takes them from the browser's cache.
  await Promise.all(files.map(async ({ url, integrity }) => {
    const response = await fetch(url, { integrity }).catch(() => { throw new Error(`${url} cannot be loaded`); });
    await response.body.pipeTo(new WritableStream({ write(chunk) {
      loaded += chunk.length;
      $('progress').value = loaded / total;
    } }));
  }));
  const python = await loadPyodide({ indexURL: new URL('.', new URL(files[0].url, document.baseURI)).href });
  const modules = await fetch('turtle_brick.zip');
  python.unpackArchive(await modules.arrayBuffer(), 'zip');
  return python;
}

// The robot, as described by its URDF.

const numbers = (element, name) => element.getAttribute(name).trim().split(/\s+/).map(Number);

function atOrigin(object, element) {
  const origin = element.querySelector(':scope > origin');
  object.position.set(...numbers(origin, 'xyz'));
  object.rotation.set(...numbers(origin, 'rpy'), 'ZYX');
  return object;
}

function solid(element) {
  if (element.tagName === 'box') return new THREE.BoxGeometry(...numbers(element, 'size'));
  const [radius] = numbers(element, 'radius');
  if (element.tagName === 'sphere') return new THREE.SphereGeometry(radius, 24, 16);
  return new THREE.CylinderGeometry(radius, radius, ...numbers(element, 'length'), 48).rotateX(Math.PI / 2);
}

function robotFrom(urdf) {
  const robot = new DOMParser().parseFromString(urdf, 'text/xml');
  const colors = {}, links = {}, joints = {};
  for (const color of robot.querySelectorAll('material > color')) {
    const [red, green, blue] = numbers(color, 'rgba');
    colors[color.parentElement.getAttribute('name')] = new THREE.Color().setRGB(red, green, blue, THREE.SRGBColorSpace);
  }
  for (const link of robot.querySelectorAll('robot > link')) {
    const group = links[link.getAttribute('name')] = new THREE.Group();
    for (const visual of link.querySelectorAll('visual')) {
      const color = colors[visual.querySelector('material').getAttribute('name')];
      group.add(atOrigin(new THREE.Mesh(solid(visual.querySelector('geometry > *')),
                                        new THREE.MeshLambertMaterial({ color })), visual));
    }
  }
  for (const joint of robot.querySelectorAll('robot > joint')) {
    const [parent, child] = ['parent', 'child'].map(tag => links[joint.querySelector(tag).getAttribute('link')]);
    parent.add(atOrigin(new THREE.Group(), joint).add(child));
    const axis = joint.querySelector('axis');
    if (axis) joints[joint.getAttribute('name')] = { child, axis: new THREE.Vector3(...numbers(axis, 'xyz')) };
  }
  return { group: links.base_link, joints };
}

// The scene.

function makeScene({ size, brick, wall }) {
  const scene = new THREE.Scene();
  const add = (geometry, color, x, y, z, options) => {
    const mesh = new THREE.Mesh(geometry, new THREE.MeshLambertMaterial({ color, ...options }));
    mesh.position.set(x, y, z);
    return scene.add(mesh) && mesh;
  };
  const middle = size / 2, glass = { transparent: true, opacity: 0.5 };
  const sun = new THREE.DirectionalLight('white', 1.6);
  sun.position.set(3, -6, 12);
  const grid = new THREE.GridHelper(size, 11, 'silver', 'silver').rotateX(Math.PI / 2);
  grid.position.set(middle, middle, 0.002);
  scene.add(new THREE.HemisphereLight('white', 'gray', 2.2), sun, grid);
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

// The page.

async function start() {
  if (!window.WebAssembly) throw new Error('this browser has no WebAssembly');
  if (!document.createElement('canvas').getContext('webgl2')) throw new Error('this browser has no WebGL 2');
  THREE.Object3D.DEFAULT_UP.set(0, 0, 1);
  const python = window.python = await loadPython();
  const arena = window.arena = python.runPython('from web_arena import WebArena\nWebArena()');
  const constants = JSON.parse(arena.constants());
  const { sliders, size, heights } = constants;
  const { scene, ground, disc, brick, line } = makeScene(constants);
  const renderer = new THREE.WebGLRenderer({ canvas: $('view'), antialias: true, alpha: true });
  renderer.localClippingEnabled = true;
  renderer.setPixelRatio(Math.min(devicePixelRatio, 2));
  const camera = new THREE.PerspectiveCamera(45, 1, 0.1, 200);
  let robot;
  const orbit = new OrbitControls(camera, $('view'));
  orbit.target.set(size / 2, size / 2, 3);
  orbit.listenToKeyEvents($('view'));
  const resize = () => {
    const { clientWidth: width, clientHeight: height } = $('scene');
    camera.aspect = width / height;
    const away = Math.max(1, 1.15 / camera.aspect);
    if (!robot) camera.position.set(size / 2 + 3 * away, size / 2 - 16 * away, 3 + 7 * away);
    camera.updateProjectionMatrix();
    renderer.setSize(width, height, false);
  };
  resize();
  new ResizeObserver(resize).observe($('scene'));

  // The form contains the whole state of the page. The address can contain it, too.
  $('parameters').innerHTML = sliders.map(([name, label, lower, upper, value]) => `<label>${label}<br>
    <input type="range" name="${name}" min="${lower}" max="${upper}" step="any" value="${value}">
    <output></output></label>`).join('');
  [form.z.min, form.z.max] = heights;
  [form.x.value, form.y.value, form.z.value] = constants.start;
  for (const [name, value] of new URLSearchParams(location.hash.slice(1))) {
    const field = form.elements[name];
    if (field?.type === 'checkbox') field.checked = true;
    else if (field) field.value = value;
  }
  const call = (...input) => { $('error').textContent = arena.call(...input); };
  const place = () => call('place', form.x.valueAsNumber, form.y.valueAsNumber, form.z.valueAsNumber);
  const apply = () => {
    call('set_parameters', JSON.stringify(Object.fromEntries(
      sliders.map(([name]) => [name, form[name].valueAsNumber]))));
    scene.remove(robot?.group);
    robot = robotFrom(arena.urdf());
    scene.add(robot.group);
  };
  const onInput = name => {
    if (sliders.some(slider => slider[0] === name)) apply();
    if ('xyz'.includes(name)) place();
    if (name === 'tilt') arena.simulation.tilt(form.tilt.valueAsNumber);
    arena.is_random = form.random.checked;
    arena.predicts = !form.last_pose.checked;
    for (const output of form.querySelectorAll('label output')) {
      output.value = Number(output.previousElementSibling.value).toFixed(2);
    }
  };
  form.addEventListener('input', event => onInput(event.target.name));
  form.addEventListener('submit', event => {
    event.preventDefault();
    call('drop');
  });
  $('copy').addEventListener('click', () => {
    location.hash = new URLSearchParams(new FormData(form));
    navigator.clipboard?.writeText(location.href);
  });
  let pressed;
  $('view').addEventListener('pointerdown', event => { pressed = event; });
  $('view').addEventListener('pointerup', event => {
    if (Math.hypot(event.clientX - pressed.clientX, event.clientY - pressed.clientY) > 6) return;
    const { left, top, width, height } = $('view').getBoundingClientRect();
    const ray = new THREE.Raycaster();
    ray.setFromCamera(new THREE.Vector2(2 * (event.clientX - left) / width - 1,
                                        1 - 2 * (event.clientY - top) / height), camera);
    const [hit] = ray.intersectObject(ground);
    if (hit && form.mode.value === 'drive') arena.simulation.drive_to(hit.point.x, hit.point.y);
    if (!hit || form.mode.value === 'drive') return;
    [form.x.value, form.y.value] = [hit.point.x.toFixed(2), hit.point.y.toFixed(2)];
    place();
  });

  let last = performance.now();
  let plotted = 0;
  const draw = now => {
    const state = JSON.parse(arena.advance(Math.min((now - last) / 1000, 0.1) * form.speed.value));
    last = now;
    const [x, y, yaw] = state.robot;
    robot.group.position.set(x, y, 0);
    robot.group.rotation.z = yaw;
    for (const [name, { child, axis }] of Object.entries(robot.joints)) {
      child.setRotationFromAxisAngle(axis, state.joints[name]);
    }
    brick.position.set(...state.brick);
    brick.quaternion.set(...state.orientation);
    line.position.set(state.brick[0], state.brick[1], state.brick[2] / 2);
    line.scale.z = state.brick[2];
    disc.position.set(x, y, 0.004);
    disc.scale.setScalar(Math.max(state.guaranteed, 0.001));
    orbit.update();
    renderer.render(scene, camera);
    const label = new THREE.Vector3(0, 0, 0.6).add(brick.position).project(camera);
    $('unreachable').hidden = !state.unreachable;
    $('unreachable').style.translate = `calc(${50 * label.x}cqw - 50%) calc(${-50 * label.y}cqh - 50%)`;
    for (const [id, text] of Object.entries(state.texts)) {
      if ($(id).textContent !== text) $(id).textContent = text;
    }
    if (now > plotted + 200) {
      plotted = now;
      $('plots').innerHTML = arena.plots();
    }
    requestAnimationFrame(draw);
  };
  place();
  apply();
  onInput('tilt');
  draw(last);
  $('loading').hidden = true;
}

start().catch(error => fail(`The page cannot start: ${error.message}`));
