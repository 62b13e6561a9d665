"""OpenGL in software (Mesa's llvmpipe): one draw a facet into a quilt of the same size and channels.

It is given the best case: buffers that lie ready, and the triangles already sorted to the facets. It
draws the rectangles of facets, not their polygons, and its depth is an interpolated one.
"""

from __future__ import annotations

import os
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from quiltcli.geometry import Float32Array, FloatArray
from quiltcli.render.setup import Stage
from quiltcli.visibility.draw import Frame
from tests.benchmarks.stages import facet_pairs

_VERTEX = """#version 330
uniform mat4 matrix;
in vec3 position;
in vec3 normal;
in vec2 uv;
out vec3 surface;
out vec3 point;
out vec2 place;
void main() { gl_Position = matrix * vec4(position, 1); surface = normal; point = position; place = uv; }
"""

_LAMBERT = """#version 330
in vec3 surface;
in vec3 point;
out vec4 color;
const vec3 base = vec3(0.8, 0.5, 0.3), sun = normalize(vec3(1, 2, 1.5));
void main() {
    vec3 n = normalize(surface);
    color = vec4(base * (0.1 + 0.95 * max(dot(n, sun) * sign(-dot(n, point)), 0)), 1);
}
"""

# The same light that `quiltcli.shading.shade` computes.
_GGX = """#version 330
in vec3 surface;
in vec3 point;
out vec4 color;
const vec3 base = vec3(0.8, 0.5, 0.3), sun = normalize(vec3(1, 2, 1.5));
float fifth(float x) { return x * x * x * x * x; }
void main() {
    vec3 v = normalize(-point), n = normalize(surface);
    n = dot(n, v) < 0 ? -n : n;
    float nv = max(dot(n, v), 1e-4), nl = max(dot(n, sun), 0), a2 = 0.0625;
    float half_angle = max(1 + dot(v, sun), 1e-4);
    float nh2 = min(0.5 * (nl + nv) * (nl + nv) / half_angle, 1);
    float spread = 1 - nh2 * (1 - a2);
    float masking = nl * sqrt(a2 + (1 - a2) * nv * nv) + nv * sqrt(a2 + (1 - a2) * nl * nl);
    float specular = nl * a2 * 0.1591549 / (spread * spread * masking);
    float grazing = fifth(1 - sqrt(0.5 * half_angle));
    float diffuse = nl * 0.3055775 * (1 - fifth(1 - nl)) * (1 - fifth(1 - nv));
    float layer = specular * (1 - grazing);
    color = vec4(base * 0.1 + 3 * (base * diffuse + vec3(0.04) * layer + vec3(specular * grazing)), 1);
}
"""
# The same under a picture.
_TEXTURED = _GGX.replace(
    "const vec3 base = vec3(0.8, 0.5, 0.3), sun", "in vec2 place;\nuniform sampler2D picture;\nconst vec3 sun"
).replace(
    "void main() {", "void main() {\n    vec3 base = texture(picture, place).rgb * vec3(0.8, 0.5, 0.3);"
)
_SRGB8 = 0x8C41


def renderer() -> str:
    """The name of the software renderer; why there is none, after a minus sign, if there is none."""
    try:
        context = _context()
    except ImportError:
        return "-moderngl is not installed (pip install '.[bench]')"
    except Exception as error:
        return f"-no OpenGL through EGL ({error}); Debian has it in libegl1 and libgl1-mesa-dri"
    name = str(context.info["GL_RENDERER"])
    context.release()
    return name if "llvmpipe" in name else f"-{name} is no software renderer (LIBGL_ALWAYS_SOFTWARE=1?)"


def _context() -> Any:
    os.environ.setdefault("LIBGL_ALWAYS_SOFTWARE", "1")
    import moderngl

    how: dict[str, Any] = {"backend": "egl"}
    return moderngl.create_standalone_context(**how)


@dataclass(frozen=True)
class _Draw:
    """One facet: rectangle x, y, width, height on the page, matrix, and its part of the sorted indices."""

    rectangle: tuple[int, int, int, int]
    matrix: bytes
    first: int
    count: int


class Quilt:
    """A quilt of one page on the renderer, and a frame's draws; a context manager."""

    def __init__(
        self, stage: Stage, frame: Frame, *, culling: bool, picture: NDArray[np.uint8] | None = None
    ) -> None:
        self._context = _context()
        size = tuple(stage.layout.pages[0].tolist())
        colour = self._context.texture(size, 4, dtype="f2")
        self._target = self._context.framebuffer([colour], self._context.depth_texture(size))
        self._context.front_face = "cw"  # rows of the quilt go down, rows of OpenGL up
        self._colour = np.empty(size[0] * size[1] * 8, np.uint8)
        self._depth = np.empty(size[0] * size[1] * 4, np.uint8)
        self._draws = _draws(stage, frame)
        self._culling = culling
        triangle, _ = facet_pairs(frame)
        scene = stage.scene
        uv = np.zeros((len(scene.vertices), 2)) if scene.uv is None else scene.uv
        places = frame.sight.vertices.astype(np.float32)
        vertices = np.hstack((places, scene.normals, uv.astype(np.float32)))
        self._vertices = self._context.buffer(vertices.tobytes())
        self._sorted = self._context.buffer(
            np.ascontiguousarray(scene.triangles[triangle]).tobytes() or b"0" * 12
        )
        self._whole = self._context.buffer(scene.triangles.tobytes())
        self._indices = scene.triangles.size
        self._programs = {
            name: self._context.program(vertex_shader=_VERTEX, fragment_shader=shader)
            for name, shader in (("lambert", _LAMBERT), ("ggx", _GGX), ("textured", _TEXTURED))
        }
        if picture is not None:
            size = picture.shape[1::-1]
            texture = self._context.texture(size, 3, picture.tobytes(), internal_format=_SRGB8)
            texture.build_mipmaps()
            texture.filter = self._context.LINEAR_MIPMAP_LINEAR, self._context.LINEAR
            texture.use()

    def __enter__(self) -> Quilt:
        return self

    def __exit__(self, *_: object) -> None:
        self._context.release()

    def draw(self, shading: str, *, whole_mesh: bool = False) -> None:
        """Draw the frame and wait for its end: each facet its own triangles, or each the whole mesh."""
        with self._context:  # of several contexts the one made last would get the commands
            self._draw(shading, whole_mesh)

    def _draw(self, shading: str, whole_mesh: bool) -> None:
        context, program = self._context, self._programs[shading]
        target = self._target
        target.use()
        target.scissor = None
        target.clear(0, 0, 0, 0, depth=1)
        wanted = context.DEPTH_TEST | (context.CULL_FACE if self._culling else context.NOTHING)
        context.enable_only(wanted)
        if "uv" in program:
            content = [(self._vertices, "3f 3f 2f", "position", "normal", "uv")]
        else:
            content = [(self._vertices, "3f 3f 8x", "position", "normal")]
        array = context.vertex_array(program, content, self._whole if whole_mesh else self._sorted)
        for draw in self._draws:
            target.viewport = target.scissor = draw.rectangle
            program["matrix"].write(draw.matrix)
            if whole_mesh:
                array.render(vertices=self._indices)
            elif draw.count:
                array.render(vertices=draw.count, first=draw.first)
        context.finish()
        array.release()

    def read(self) -> None:
        """Bring colour and depth to the program's memory, as half floats and floats."""
        with self._context:
            self._target.read_into(self._colour, components=4, dtype="f2")
            self._target.read_into(self._depth, components=1, attachment=-1, dtype="f4")

    @property
    def depth(self) -> Float32Array:
        """What `read` has read of the depth buffer, flat."""
        return self._depth.view(np.float32)


def _draws(stage: Stage, frame: Frame) -> list[_Draw]:
    """The draws of the lit facets of the first page, each with its off-axis matrix."""
    blocks, lit = frame.blocks, np.flatnonzero(frame.rays.lit)
    _, facet = facet_pairs(frame)
    start = np.searchsorted(facet, np.arange(stage.facets.count + 1))
    draws = []
    for f in lit.tolist():
        mine = slice(blocks.start[f], blocks.start[f + 1])
        x, y = int(blocks.x0[mine].min()), int(blocks.y0[mine].min())
        width = int((blocks.x0[mine] + blocks.width[mine]).max()) - x
        height = int((blocks.y0[mine] + blocks.height[mine]).max()) - y
        matrix = _clip_from_eye(frame.rays.quilt_from_eye[f], (x, y, width, height))
        first, last = int(start[f]), int(start[f + 1])
        draws.append(
            _Draw((x, y, width, height), matrix.T.astype("f4").tobytes(), 3 * first, 3 * (last - first))
        )
    return draws


def _clip_from_eye(quilt_from_eye: FloatArray, rectangle: tuple[int, int, int, int]) -> FloatArray:
    """The matrix (4, 4) from points minus the eye to clip coordinates of a facet's rectangle.

    W is 1 on the facet's plane; what is drawn lies between a hundredth and a hundred times as far.
    """
    x, y, width, height = rectangle
    X, Y, W = quilt_from_eye
    near, far = 0.01, 100.0
    result = np.zeros((4, 4))
    result[0, :3] = 2 * (X - x * W) / width - W
    result[1, :3] = 2 * (Y - y * W) / height - W
    result[2, :3] = (far + near) / (far - near) * W
    result[2, 3] = -2 * far * near / (far - near)
    result[3, :3] = W
    return result
