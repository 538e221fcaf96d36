// What the page of a result needs of three.js: esbuild leaves out the rest.
export {
  AnimationMixer, BasicShadowMap, Box3, BoxGeometry, BufferAttribute, BufferGeometry, CanvasTexture,
  CapsuleGeometry, Color, ConeGeometry, CylinderGeometry, DirectionalLight, Group, HemisphereLight,
  Line, LineBasicMaterial, Mesh, MeshBasicMaterial, MeshLambertMaterial,
  MeshStandardMaterial, PCFShadowMap, PerspectiveCamera, PlaneGeometry, RepeatWrapping, Scene,
  SphereGeometry, SRGBColorSpace, Vector3, WebGLRenderer,
} from "three";
export { GLTFLoader } from "three/examples/jsm/loaders/GLTFLoader.js";
export { OrbitControls } from "three/examples/jsm/controls/OrbitControls.js";
export { clone as cloneSkinned } from "three/examples/jsm/utils/SkeletonUtils.js";
