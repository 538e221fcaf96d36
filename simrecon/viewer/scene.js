"use strict";
// The motion in 3D: the person, their ghost, forces, centre of mass, floor and items; from a free or the real camera.
const SimreconScene = (() => {
  const ARROW_M = 0.5; // of a force of one body weight
  const LEFT = new THREE.Color(0xf08a34), RIGHT = new THREE.Color(0x2aa3b5), CENTRE = new THREE.Color(0xc9ccd3);
  const GHOST = 0x6f7cff, FUTURE = 0x2a9d6f, FORCE = 0xe5484d, MASS = 0xf5c518;
  const SLOW_MS = 36, JUDGED = 10, REST_MS = 200; // a slow machine draws what moves with less, and sharpens what rests
  const LEVELS = [{ ratio: 2, shadow: true }, { ratio: 1, shadow: true }, { ratio: 0.7, shadow: true }, { ratio: 0.5, shadow: false }];

  function bytesOf(base64) {
    const text = atob(base64), bytes = new Uint8Array(text.length);
    for (let i = 0; i < text.length; i++) bytes[i] = text.charCodeAt(i);
    return bytes;
  }

  // Left limbs orange, right ones teal, as in the overlay: by the segments that move a vertex.
  function tint(mesh) {
    const { skinIndex, skinWeight } = mesh.geometry.attributes, bones = mesh.skeleton.bones;
    const colours = new Float32Array(3 * skinIndex.count), colour = new THREE.Color();
    const sides = bones.map(bone => bone.name.startsWith("left_") ? 1 : bone.name.startsWith("right_") ? 2 : 0);
    for (let v = 0; v < skinIndex.count; v++) {
      const share = [0, 0, 0];
      for (let k = 0; k < 4; k++) share[sides[skinIndex.getComponent(v, k)]] += skinWeight.getComponent(v, k);
      colour.copy(CENTRE).lerp(LEFT, 0.85 * share[1]).lerp(RIGHT, 0.85 * share[2]);
      colour.toArray(colours, 3 * v);
    }
    mesh.geometry.setAttribute("color", new THREE.BufferAttribute(colours, 3));
    mesh.material = new THREE.MeshStandardMaterial({ vertexColors: true, roughness: 0.62, metalness: 0 });
  }

  function primitive(part) {
    const side = part.name.startsWith("left_") ? LEFT : part.name.startsWith("right_") ? RIGHT : CENTRE;
    const material = new THREE.MeshStandardMaterial({ color: side, roughness: 0.62 });
    const [a, b] = part.points_m.map(point => new THREE.Vector3(...point));
    if (part.kind === "box") {
      const mesh = new THREE.Mesh(new THREE.BoxGeometry(...part.size_m.map(half => 2 * half)), material);
      mesh.position.copy(a);
      return mesh;
    }
    const along = b.clone().sub(a);
    const mesh = new THREE.Mesh(new THREE.CapsuleGeometry(part.size_m[0], along.length(), 8, 20), material);
    mesh.position.copy(a).add(b).multiplyScalar(0.5);
    if (along.length() > 1e-6) mesh.quaternion.setFromUnitVectors(new THREE.Vector3(0, 1, 0), along.normalize());
    return mesh;
  }

  function canvasTexture(size, draw) {
    const canvas = document.createElement("canvas");
    canvas.width = canvas.height = size;
    draw(canvas.getContext("2d"), size);
    return new THREE.CanvasTexture(canvas);
  }

  // A grid of one metre on the floor, which fades out.
  function dressFloor(mesh, renderer, plain) {
    const at = mesh.geometry.attributes.position, low = [Infinity, Infinity], high = [-Infinity, -Infinity];
    for (let i = 0; i < at.count; i++) {
      for (let k = 0; k < 2; k++) {
        low[k] = Math.min(low[k], at.getComponent(i, k));
        high[k] = Math.max(high[k], at.getComponent(i, k));
      }
    }
    const grid = new Float32Array(2 * at.count), fade = new Float32Array(2 * at.count);
    for (let i = 0; i < at.count; i++) {
      for (let k = 0; k < 2; k++) {
        const far = (at.getComponent(i, k) - low[k]) / (high[k] - low[k]);
        const place = (low[k] + high[k]) / 2 + (far - 0.5) * 2.4 * (high[k] - low[k]);
        at.setComponent(i, k, place);
        grid[2 * i + k] = place;
        fade[2 * i + k] = far;
      }
    }
    mesh.geometry.setAttribute("uv", new THREE.BufferAttribute(grid, 2));
    mesh.geometry.setAttribute("uv1", new THREE.BufferAttribute(fade, 2));
    mesh.geometry.computeBoundingSphere();
    const map = canvasTexture(256, (pen, size) => {
      pen.fillStyle = "#fff";
      pen.fillRect(0, 0, size, size);
      pen.strokeStyle = "#d3d8de";
      pen.lineWidth = 2;
      pen.strokeRect(0, 0, size / 2, size / 2);
      pen.strokeRect(size / 2, size / 2, size / 2, size / 2);
      pen.strokeStyle = "#aeb6c0";
      pen.lineWidth = 5;
      pen.strokeRect(0, 0, size, size);
    });
    map.wrapS = map.wrapT = THREE.RepeatWrapping;
    map.colorSpace = THREE.SRGBColorSpace;
    if (!plain) map.anisotropy = Math.min(8, renderer.capabilities.getMaxAnisotropy());
    const alphaMap = canvasTexture(256, (pen, size) => {
      const round = pen.createRadialGradient(size / 2, size / 2, size * 0.08, size / 2, size / 2, size / 2);
      round.addColorStop(0, "#eee");
      round.addColorStop(0.45, "#888");
      round.addColorStop(1, "#000");
      pen.fillStyle = round;
      pen.fillRect(0, 0, size, size);
    });
    alphaMap.channel = 1;
    mesh.material = new THREE.MeshLambertMaterial({
      map, alphaMap, transparent: true, depthWrite: false, polygonOffset: true, polygonOffsetFactor: 2, polygonOffsetUnits: 2,
    });
    mesh.receiveShadow = true;
    mesh.renderOrder = -1;
  }

  function arrow() {
    const material = new THREE.MeshBasicMaterial({ color: FORCE, depthTest: false, transparent: true, opacity: 0.92 });
    const shaft = new THREE.Mesh(new THREE.CylinderGeometry(0.011, 0.011, 1, 12), material);
    const head = new THREE.Mesh(new THREE.ConeGeometry(0.03, 0.085, 16), material);
    const group = new THREE.Group();
    shaft.renderOrder = head.renderOrder = 4; // over the body, in which many begin
    group.add(shaft, head);
    group.userData = { shaft, head };
    return group;
  }

  function pointArrow(group, from, force_N, weight_N) {
    const force = new THREE.Vector3(...force_N), length = force.length() / weight_N * ARROW_M;
    group.visible = length > 0.012;
    if (!group.visible) return;
    const { shaft, head } = group.userData, tip = Math.min(0.085, 0.6 * length);
    group.position.set(...from);
    group.quaternion.setFromUnitVectors(new THREE.Vector3(0, 1, 0), force.normalize());
    shaft.scale.y = length - tip;
    shaft.position.y = (length - tip) / 2;
    head.scale.setScalar(tip / 0.085);
    head.position.y = length - tip / 2;
  }

  function massMark() {
    const group = new THREE.Group();
    const material = new THREE.MeshBasicMaterial({ color: MASS, depthTest: false, transparent: true });
    const ball = new THREE.Mesh(new THREE.SphereGeometry(0.035, 24, 16), material);
    const points = new THREE.BufferGeometry().setFromPoints([new THREE.Vector3(), new THREE.Vector3(0, -1, 0)]);
    const line = new THREE.Line(points, new THREE.LineBasicMaterial({ color: MASS, depthTest: false, transparent: true, opacity: 0.8 }));
    const foot = new THREE.Mesh(new THREE.CylinderGeometry(0.05, 0.05, 0.004, 32), material);
    ball.renderOrder = line.renderOrder = foot.renderOrder = 5;
    group.add(ball, line, foot);
    group.userData = { line, foot };
    return group;
  }

  class View {
    constructor(canvas, data) {
      this.data = data;
      this.canvas = canvas;
      this.renderer = new THREE.WebGLRenderer({ canvas, antialias: true, alpha: true });
      this.plain = drawsOnProcessor(this.renderer.getContext());
      this.renderer.shadowMap.enabled = true;
      this.renderer.shadowMap.type = this.plain ? THREE.BasicShadowMap : THREE.PCFShadowMap;
      this.fine = Math.min(this.plain ? 1 : 2, devicePixelRatio || 1);
      this.level = this.plain ? 2 : 0;
      this.moved = -1e9;
      this.scene = new THREE.Scene();
      this.camera = new THREE.PerspectiveCamera(32, 1, 0.05, 200);
      this.real = new THREE.PerspectiveCamera(32, 1, 0.05, 200);
      this.real.matrixAutoUpdate = false;
      this.controls = new THREE.OrbitControls(this.camera, canvas);
      this.controls.enableDamping = true;
      this.controls.dampingFactor = 0.12;
      this.controls.maxPolarAngle = Math.PI * 0.55;
      this.controls.minDistance = 0.6;
      this.controls.maxDistance = 40;
      this.controls.addEventListener("change", () => { this.dirty = true; this.moved = performance.now(); });
      this.shown = { body: "skin", ghost: false, futures: true, forces: true, mass: false, real: false, follow: true };
      this.dirty = true;
      this.slow = [];
      this.light();
    }

    light() {
      this.scene.add(new THREE.HemisphereLight(0xffffff, 0x9aa3b2, 1.9));
      const sun = this.sun = new THREE.DirectionalLight(0xffffff, 2.1);
      sun.castShadow = true;
      sun.shadow.mapSize.setScalar(this.plain ? 512 : 1024);
      Object.assign(sun.shadow.camera, { left: -2.2, right: 2.2, top: 2.2, bottom: -2.2, near: 0.5, far: 14 });
      sun.shadow.bias = -0.0006;
      sun.shadow.normalBias = 0.02;
      sun.shadow.radius = 5;
      const rim = new THREE.DirectionalLight(0xdfe8ff, 0.9);
      rim.position.set(-3, 2, -4);
      this.scene.add(sun, sun.target, rim);
    }

    load(base64) {
      return new Promise((done, failed) => {
        new THREE.GLTFLoader().parse(bytesOf(base64).buffer, "", model => { this.take(model); done(); }, failed);
      });
    }

    take(model) {
      const roots = [...model.scene.children];
      this.person = new THREE.Group();
      this.items = new THREE.Group();
      this.scene.add(this.person, this.items);
      for (const root of roots) {
        const mine = root.isSkinnedMesh || root.isBone || root.name === "pelvis";
        (mine ? this.person : this.items).add(root);
      }
      this.person.traverse(node => { if (node.isSkinnedMesh) this.skin = node; });
      tint(this.skin);
      this.skin.frustumCulled = false;
      this.skin.castShadow = true;
      this.skin.receiveShadow = !this.plain;
      this.items.traverse(node => {
        if (!node.isMesh) return;
        if (node.name === "ground") { this.floor = node; dressFloor(node, this.renderer, this.plain); } else {
          node.castShadow = node.receiveShadow = true;
          node.material.roughness = 0.85;
        }
      });
      this.motion = this.play(this.scene, model.animations.find(clip => clip.name === "motion"));
      const fit = model.animations.find(clip => clip.name === "fit");
      if (fit) [this.ghost, this.fit] = this.addGhost(fit, GHOST, 0.34);
      this.futures = model.animations.filter(clip => clip.name.startsWith("ghost ")).map(clip => this.addGhost(clip, FUTURE, 0.22));
      this.addPrimitives();
      this.arrows = this.data.curves.forces.body.map(() => { const a = arrow(); this.scene.add(a); return a; });
      this.mass = massMark();
      this.scene.add(this.mass);
      this.frameAll();
      this.apply();
    }

    play(root, clip) {
      const mixer = new THREE.AnimationMixer(root), action = mixer.clipAction(clip);
      action.play();
      return { mixer, action, last_s: clip.duration - 1e-5 };
    }

    addGhost(clip, color, opacity) {
      const ghost = THREE.cloneSkinned(this.person);
      ghost.traverse(node => {
        if (!node.isSkinnedMesh) return;
        node.material = new THREE.MeshStandardMaterial({ color, transparent: true, opacity, roughness: 0.9 });
        node.castShadow = node.receiveShadow = false;
        node.renderOrder = 2;
      });
      this.scene.add(ghost);
      return [ghost, this.play(ghost, clip)];
    }

    addPrimitives() {
      this.primitives = [];
      for (const part of this.data.primitives) {
        const mesh = primitive(part), bone = this.person.getObjectByName(part.segment);
        mesh.castShadow = mesh.receiveShadow = true;
        bone.add(mesh);
        this.primitives.push(mesh);
      }
    }

    // From the front left, a little above, so that the whole path is seen.
    frameAll() {
      this.followed = null;
      const path = this.data.curves.com_m, box = new THREE.Box3();
      for (const place of path) box.expandByPoint(new THREE.Vector3(...place));
      const size = box.getSize(new THREE.Vector3()), reach = Math.max(size.x, size.z, 0);
      this.setTime(0);
      const ahead = new THREE.Vector3(1, 0, 0).applyQuaternion(this.person.getObjectByName("pelvis").quaternion);
      const facing = Math.atan2(-ahead.z, ahead.x) + 0.7, tall = Math.max(1.75, size.y + 1.7);
      const far = (tall + 0.35 * reach) / 2 / Math.tan(Math.PI / 180 * this.camera.fov / 2) * 1.12;
      const centre = new THREE.Vector3(...path[0]);
      this.controls.target.copy(centre);
      this.controls.target.y = box.min.y - 0.12 + size.y / 2;
      this.camera.position.set(Math.cos(facing), 0.3, -Math.sin(facing)).multiplyScalar(far).add(this.controls.target);
      this.followed = centre;
      this.controls.update();
    }

    setTheme(dark) {
      if (this.floor) this.floor.material.color.set(dark ? 0x353b44 : 0xd4d9df);
      this.dirty = true;
    }

    apply(changes = {}) {
      Object.assign(this.shown, changes);
      const { body, ghost, forces, mass, real } = this.shown;
      this.skin.visible = body === "skin";
      for (const mesh of this.primitives) mesh.visible = body === "primitives";
      if (this.ghost) this.ghost.visible = ghost;
      this.items.visible = !real;
      this.controls.enabled = !real;
      this.mass.visible = mass;
      this.showForces = forces;
      this.setTime(this.time || 0);
    }

    setTime(time) {
      this.time = time;
      for (const clip of [this.motion, this.fit]) {
        if (!clip) continue;
        clip.action.time = Math.min(time, clip.last_s);
        clip.mixer.update(0);
      }
      if (this.futures) this.placeFutures(time);
      const { com_m, forces, weight_N, times_s } = this.data.curves;
      const frame = this.frame = SimreconScene.nearest(times_s, time), com = new THREE.Vector3(...com_m[frame]);
      (this.arrows || []).forEach((group, i) => {
        group.visible = false;
        if (this.showForces) pointArrow(group, forces.place_m[frame][i], forces.force_N[frame][i], weight_N);
      });
      if (this.mass) this.placeMass(com);
      if (this.followed) this.follow(com);
      this.sun.position.set(com.x + 2.2, 5.5, com.z + 1.6);
      this.sun.target.position.set(com.x, 0.4, com.z);
      this.dirty = true;
    }

    placeFutures(time) {
      for (const [ghost, clip] of this.futures) {
        const since = time - this.data.ghosts.from_s;
        ghost.visible = this.shown.futures && since >= 0;
        clip.action.time = Math.min(Math.max(since, 0), clip.last_s);
        clip.mixer.update(0);
      }
    }

    placeMass(com) {
      const { line, foot } = this.mass.userData, down = com.y - (this.floor ? this.floor.position.y : 0);
      this.mass.position.copy(com);
      line.scale.y = Math.max(down, 0.001);
      foot.position.y = -down;
    }

    follow(com) {
      const step = com.clone().sub(this.followed);
      step.y = 0;
      this.followed = com;
      if (!this.shown.follow) return;
      this.controls.target.add(step);
      this.camera.position.add(step);
    }

    // The real camera over its image, which lies in `box` (left, top, width, height; CSS pixels of the canvas).
    placeReal(box) {
      const seen = this.data.camera, { width, height } = this.size, scale = box.width / seen.size_px[0];
      const [fx, fy] = seen.focal_px.map(f => f * scale);
      const cx = seen.centre_px[0] * scale + box.left, cy = seen.centre_px[1] * scale + box.top;
      const near = 0.05, far = 200;
      this.real.projectionMatrix.set(
        2 * fx / width, 0, 1 - 2 * cx / width, 0,
        0, 2 * fy / height, 2 * cy / height - 1, 0,
        0, 0, -(far + near) / (far - near), -2 * far * near / (far - near),
        0, 0, -1, 0);
      this.real.projectionMatrixInverse.copy(this.real.projectionMatrix).invert();
      const rows = seen.views[seen.views.length > 1 ? this.frame : 0];
      this.real.matrix.set(...rows, 0, 0, 0, 1).invert();
      this.real.matrixWorldNeedsUpdate = true;
      this.dirty = true;
    }

    resize(width, height) {
      if (!width || !height) return;
      this.size = { width, height };
      this.renderer.setSize(width, height, false);
      this.camera.aspect = width / height;
      this.camera.fov = width < height ? 42 : 32;
      this.camera.updateProjectionMatrix();
      this.dirty = true;
    }

    // Draws if anything changed, coarsely while it moves on a slow machine.
    draw(playing) {
      const now = performance.now();
      if (!this.shown.real) this.controls.update();
      const moving = playing || now - this.moved < REST_MS, { ratio, shadow } = LEVELS[moving ? this.level : 0];
      const wanted = Math.min(this.fine, ratio);
      if (!this.size || (!this.dirty && (moving || wanted === this.ratio))) return;
      if (wanted !== this.ratio) this.renderer.setPixelRatio(this.ratio = wanted);
      this.sun.castShadow = shadow;
      this.dirty = false;
      this.renderer.render(this.scene, this.shown.real ? this.real : this.camera);
      if (playing) this.judge(now);
    }

    judge(now) {
      this.slow.push(now);
      if (this.slow.length <= JUDGED) return;
      const mean = (now - this.slow[0]) / JUDGED;
      this.slow = [];
      if (mean > SLOW_MS && mean < 1000 && this.level < LEVELS.length - 1) this.level += 1;
    }

    picture() {
      this.renderer.render(this.scene, this.shown.real ? this.real : this.camera);
      return this.canvas.toDataURL("image/png");
    }
  }

  // Whether WebGL is drawn by the processor, as where there is no graphics card.
  function drawsOnProcessor(gl) {
    const told = gl.getExtension("WEBGL_debug_renderer_info");
    return /swiftshader|llvmpipe|softpipe|basic render/i.test(told ? gl.getParameter(told.UNMASKED_RENDERER_WEBGL) : "");
  }

  // Index of the value nearest to x in increasing values.
  function nearest(values, x) {
    let low = 0, high = values.length - 1;
    while (high - low > 1) {
      const middle = (low + high) >> 1;
      if (values[middle] <= x) low = middle; else high = middle;
    }
    return x - values[low] <= values[high] - x ? low : high;
  }

  return { View, nearest, bytesOf };
})();
