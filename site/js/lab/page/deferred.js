/**
 * The next picture of a canvas, drawn without a graphics processor.
 *
 * A browser without one reads the canvas back whenever the page changes, and the page waits until all of it is drawn. So a picture
 * is drawn into a texture, which takes long and nobody waits for, and then copied to the canvas, which takes a moment.
 */

import { Mesh, OrthographicCamera, PlaneGeometry, Scene, ShaderMaterial, WebGLRenderTarget } from 'three'

export class DeferredPicture {
  /** @param {import('three').WebGLRenderer} renderer that of the canvas */
  constructor(renderer) {
    this.renderer = renderer
    this.view = null // whose picture is being drawn
    this.fence = null // tells when it is
    this.target = new WebGLRenderTarget(1, 1, { stencilBuffer: true })
    this.scene = new Scene().add(sheet(this.target.texture))
    this.lens = new OrthographicCamera()
  }

  /** Begin the picture of a view, with `sharpness` device pixels per CSS pixel, by calling `render`. */
  begin(view, sharpness, render) {
    const { renderer, target } = this
    target.setSize(Math.floor(view.width * sharpness), Math.floor(view.height * sharpness))
    renderer.setRenderTarget(target)
    render()
    renderer.setRenderTarget(null)
    const gl = renderer.getContext()
    this.fence = gl.fenceSync(gl.SYNC_GPU_COMMANDS_COMPLETE, 0)
    gl.flush()
    this.view = view
  }

  /** Whether the picture is drawn, or never will be: a context that is lost has no fence. */
  get isFinished() {
    const gl = this.renderer.getContext()
    return this.fence === null || gl.clientWaitSync(this.fence, 0, 0) !== gl.TIMEOUT_EXPIRED
  }

  /** Copy the picture to the canvas, which is of its size. */
  copy() {
    this.drop()
    this.renderer.render(this.scene, this.lens)
  }

  /** Forget the picture, whose view has lost the canvas. */
  drop() {
    this.renderer.getContext().deleteSync(this.fence)
    this.view = this.fence = null
  }
}

/** What fills a canvas with a picture. */
function sheet(picture) {
  const vertexShader = 'varying vec2 place; void main() { place = uv; gl_Position = vec4(position.xy, 0.0, 1.0); }'
  const fragmentShader = 'uniform sampler2D picture; varying vec2 place; void main() { gl_FragColor = texture2D(picture, place); }'
  const uniforms = { picture: { value: picture } }
  const material = new ShaderMaterial({ vertexShader, fragmentShader, uniforms, depthTest: false, depthWrite: false })
  const mesh = new Mesh(new PlaneGeometry(2, 2), material)
  mesh.frustumCulled = false
  return mesh
}
