// The parts of the libraries that the viewer uses; `make viewer` bundles them into libraries.js.
export {
  createBufferFromTypedArray, createBufferInfoFromArrays, createProgramInfo, createTexture, setAttribInfoBufferFromArray,
  setBuffersAndAttributes, setUniforms,
} from "twgl.js";
export { default as uPlot } from "uplot";
