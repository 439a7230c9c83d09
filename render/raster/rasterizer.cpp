// The only file that knows OSMesa. Its driver (llvmpipe) gives a 4.5 core profile; functions are linked, not loaded.
#define GL_GLEXT_PROTOTYPES 1
#include "render/raster/rasterizer.h"

#include <GL/osmesa.h>
// after osmesa.h, which brings gl.h
#include <GL/glext.h>
#include <sys/mman.h>

#include <algorithm>
#include <cstddef>
#include <memory>
#include <new>
#include <string>
#include <thread>
#include <type_traits>

#include "base/error.h"

namespace render::raster {
namespace {

[[noreturn]] void fail(const std::string& what) { throw base::Error({.code = base::Exit::fault, .message = "preview: " + what}); }

constexpr const char* kPointVertex = R"(#version 450 core
layout(location = 0) in vec3 position;
layout(location = 1) in vec3 color;
uniform mat4 clip;
uniform float diameter;   // [m * pixels]
out vec3 shade;
void main() {
  gl_Position = clip * vec4(position, 1);
  gl_PointSize = max(2.0, diameter / gl_Position.w);
  shade = color;
})";
constexpr const char* kPointFragment = R"(#version 450 core
in vec3 shade;
out vec4 result;
void main() {
  vec2 at = vec2(2, -2) * gl_PointCoord + vec2(-1, 1);
  float r2 = dot(at, at);
  if (r2 > 1) discard;
  float light = dot(vec3(at, sqrt(1 - r2)), vec3(-0.37, 0.56, 0.74));
  result = vec4(shade * (0.62 + 0.42 * max(light, 0.0)), 1);
})";
constexpr const char* kFacetVertex = R"(#version 450 core
layout(location = 0) in vec3 position;
layout(location = 1) in vec3 normal;
layout(location = 2) in vec3 color;
uniform mat4 clip;
uniform vec3 light;   // towards it
out vec3 shade;
void main() {
  gl_Position = clip * vec4(position, 1);
  shade = color * (0.55 + 0.45 * abs(dot(normalize(normal), light)));
})";
constexpr const char* kLineVertex = R"(#version 450 core
layout(location = 0) in vec3 position;
layout(location = 1) in vec3 color;
uniform mat4 clip;
out vec3 shade;
void main() {
  gl_Position = clip * vec4(position, 1);
  shade = color;
})";
constexpr const char* kLineFragment = R"(#version 450 core
in vec3 shade;
out vec4 result;
void main() { result = vec4(shade, 1); })";

// A square an instance, its depth the distance from the middle: the depth test keeps the nearest.
constexpr const char* kFlatVertex = R"(#version 450 core
layout(location = 0) in vec3 middle;
layout(location = 1) in vec3 color;
uniform vec2 size;
uniform float radius;
out vec3 shade;
out vec2 at;
void main() {
  at = radius * (2 * vec2(gl_VertexID & 1, gl_VertexID >> 1) - 1);
  gl_Position = vec4(vec2(2, -2) * (middle.xy + at) / size + vec2(-1, 1), 0, 1);
  shade = color;
})";
constexpr const char* kFlatFragment = R"(#version 450 core
in vec3 shade;
in vec2 at;
uniform float radius;
out vec4 result;
void main() {
  float far = length(at) / radius;
  if (far > 1) discard;
  gl_FragDepth = far;
  result = vec4(shade, 1);
})";

struct ContextDeleter {
  void operator()(OSMesaContext c) const { OSMesaDestroyContext(c); }
};
using Context = std::unique_ptr<std::remove_pointer_t<OSMesaContext>, ContextDeleter>;

/// Throws std::bad_alloc where the process can get no `bytes` more of address space.
void require_address_space(std::size_t bytes) {
  void* const place = ::mmap(nullptr, bytes, PROT_NONE, MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE, -1, 0);
  if (place == MAP_FAILED) throw std::bad_alloc();
  ::munmap(place, bytes);
}

/// The driver's compiler and threads end the program where they get no memory: what they need is asked for before. Measured with two cores, once
/// 320 MB with its threads, of which there are as many as cores up to 32, and for a picture some 64 MB and 8 bytes a pixel.
void require_memory(int width, int height) {
  constexpr std::size_t kMegabyte = 1000 * 1000, kPixel = 10;
  const std::size_t picture = 64 * kMegabyte + kPixel * static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
  const std::size_t threads = std::min<std::size_t>(32, std::thread::hardware_concurrency()), driver = 180 * kMegabyte + 80 * kMegabyte * threads;
  static const bool driver_has_room = (require_address_space(driver + picture), true);   // it stays: later pictures find it there
  if (driver_has_room) require_address_space(picture);
}

/// Mesa would keep compiled shaders in the user's cache, and say so where it cannot. Set before there are threads.
[[maybe_unused]] const int kNoShaderCache = setenv("MESA_SHADER_CACHE_DISABLE", "true", /*overwrite=*/0);

Context make_current(std::vector<std::uint8_t>& pixels, int width, int height) {
  require_memory(width, height);
  constexpr int kWanted[] = {OSMESA_FORMAT, OSMESA_RGBA, OSMESA_DEPTH_BITS, 24, OSMESA_PROFILE, OSMESA_CORE_PROFILE,
                             OSMESA_CONTEXT_MAJOR_VERSION, 4, OSMESA_CONTEXT_MINOR_VERSION, 5, 0};
  Context context(OSMesaCreateContextAttribs(kWanted, nullptr));
  if (!context) fail("OSMesa gives no OpenGL 4.5 core context");
  if (!OSMesaMakeCurrent(context.get(), pixels.data(), GL_UNSIGNED_BYTE, width, height))
    fail("OSMesa cannot draw " + std::to_string(width) + " x " + std::to_string(height) + " pixels");
  OSMesaPixelStore(OSMESA_Y_UP, 0);  // rows top-down
  return context;
}

GLuint compile(GLenum kind, const char* source) {
  const GLuint shader = glCreateShader(kind);
  glShaderSource(shader, 1, &source, nullptr);
  glCompileShader(shader);
  GLint good = 0;
  glGetShaderiv(shader, GL_COMPILE_STATUS, &good);
  if (!good) fail("a shader does not compile");
  return shader;
}

GLuint program(const char* vertex, const char* fragment) {
  const GLuint linked = glCreateProgram();
  glAttachShader(linked, compile(GL_VERTEX_SHADER, vertex));
  glAttachShader(linked, compile(GL_FRAGMENT_SHADER, fragment));
  glLinkProgram(linked);
  GLint good = 0;
  glGetProgramiv(linked, GL_LINK_STATUS, &good);
  if (!good) fail("a shader does not link");
  return linked;
}

/// Of what is drawn, along the view axis [m]; 1 where all of it is behind the camera.
double largest_depth(const Drawing& d) {
  double most = 0;
  const auto take = [&](const base::Vec3f& at) { most = std::max(most, (at.cast<double>() - d.view.position).dot(d.view.forward)); };
  for (const Disc& disc : d.discs) take(disc.middle);
  for (const Line& line : d.lines) take(line.from), take(line.to);
  for (const Corner& corner : d.corners) take(corner.place);
  return most > 0 ? most + d.radius : 1;
}

/// World to clip space, of what is not farther than `far` [m]; w is the depth along the view axis [m].
Eigen::Matrix4f clip_matrix(const view::View& v, double far) {
  const double near = 1e-3 * far;   // of 24 bits of depth 15 are left for what is half as far
  Eigen::Matrix4d world = Eigen::Matrix4d::Identity(), clip = Eigen::Matrix4d::Zero();
  world.row(0).head<3>() = v.right;
  world.row(1).head<3>() = v.up;
  world.row(2).head<3>() = v.forward;
  world.block<3, 1>(0, 3) = -(world.topLeftCorner<3, 3>() * v.position);
  clip(0, 0) = 1 / v.tan_x;
  clip(1, 1) = 1 / v.tan_y;
  clip(2, 2) = (far + near) / (far - near);
  clip(2, 3) = -2 * far * near / (far - near);
  clip(3, 2) = 1;
  return (clip * world).cast<float>();
}

/// Makes triples of floats, `parts` to an item (position, colour; position, normal, colour), the current vertex attributes: one a vertex, or
/// one an instance.
void bind(const void* items, std::size_t bytes, bool instanced, GLuint parts = 2) {
  GLuint array = 0, store = 0;
  glGenVertexArrays(1, &array);
  glBindVertexArray(array);
  glGenBuffers(1, &store);
  glBindBuffer(GL_ARRAY_BUFFER, store);
  glBufferData(GL_ARRAY_BUFFER, static_cast<GLsizeiptr>(bytes), items, GL_STATIC_DRAW);
  const auto stride = static_cast<GLsizei>(parts * 3 * sizeof(float));
  for (GLuint i = 0; i < parts; ++i) {
    glEnableVertexAttribArray(i);
    glVertexAttribPointer(i, 3, GL_FLOAT, GL_FALSE, stride, reinterpret_cast<const void*>(std::size_t{i} * 3 * sizeof(float)));
    if (instanced) glVertexAttribDivisor(i, 1);
  }
}

/// Draws items that are pairs of position and colour.
void draw(GLuint shader, GLenum mode, const Eigen::Matrix4f& clip, const void* items, std::size_t bytes, GLsizei vertices) {
  bind(items, bytes, false);
  glUseProgram(shader);
  glUniformMatrix4fv(glGetUniformLocation(shader, "clip"), 1, GL_FALSE, clip.data());
  glDrawArrays(mode, 0, vertices);
}

void draw_facets(const Drawing& d, const Eigen::Matrix4f& clip) {
  bind(d.corners.data(), d.corners.size() * sizeof(Corner), false, 3);
  const GLuint shader = program(kFacetVertex, kLineFragment);
  glUseProgram(shader);
  glUniformMatrix4fv(glGetUniformLocation(shader, "clip"), 1, GL_FALSE, clip.data());
  const base::Vec3f light = (-0.37 * d.view.right + 0.56 * d.view.up - 0.74 * d.view.forward).cast<float>();
  glUniform3f(glGetUniformLocation(shader, "light"), light.x(), light.y(), light.z());
  GLuint indices = 0;
  glGenBuffers(1, &indices);
  glBindBuffer(GL_ELEMENT_ARRAY_BUFFER, indices);
  glBufferData(GL_ELEMENT_ARRAY_BUFFER, static_cast<GLsizeiptr>(d.facets.size() * sizeof(d.facets[0])), d.facets.data(), GL_STATIC_DRAW);
  glDrawElements(GL_TRIANGLES, static_cast<GLsizei>(3 * d.facets.size()), GL_UNSIGNED_INT, nullptr);
}

void fill_background(const Drawing& d, std::vector<std::uint8_t>& pixels) {
  for (int y = 0; y < d.height; ++y) {
    const base::Vec3f c = d.top + (static_cast<float>(y) / static_cast<float>(d.height)) * (d.bottom - d.top);
    for (int x = 0; x < d.width; ++x) {
      std::uint8_t* p = &pixels[(static_cast<std::size_t>(y) * static_cast<std::size_t>(d.width) + static_cast<std::size_t>(x)) * 4];
      if (p[3] != 0) continue;
      for (int k = 0; k < 3; ++k) p[k] = static_cast<std::uint8_t>(255 * c[k] + 0.5f);
      p[3] = 255;
    }
  }
}

}  // namespace

std::vector<std::uint8_t> rasterize(const Drawing& d) {
  static_assert(sizeof(Disc) == 6 * sizeof(float) && sizeof(Line) == 9 * sizeof(float) && sizeof(Corner) == 9 * sizeof(float));
  std::vector<std::uint8_t> pixels(static_cast<std::size_t>(d.width) * static_cast<std::size_t>(d.height) * 4);
  const Context context = make_current(pixels, d.width, d.height);
  glViewport(0, 0, d.width, d.height);
  glClearColor(0, 0, 0, 0);
  glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
  glEnable(GL_DEPTH_TEST);
  glEnable(GL_PROGRAM_POINT_SIZE);
  const Eigen::Matrix4f clip = clip_matrix(d.view, 1.01 * largest_depth(d));
  if (!d.discs.empty()) {
    const GLuint discs = program(kPointVertex, kPointFragment);
    glUseProgram(discs);
    glUniform1f(glGetUniformLocation(discs, "diameter"), d.radius * static_cast<float>(d.height / d.view.tan_y));
    draw(discs, GL_POINTS, clip, d.discs.data(), d.discs.size() * sizeof(Disc), static_cast<GLsizei>(d.discs.size()));
  }
  if (!d.facets.empty()) draw_facets(d, clip);
  if (!d.lines.empty()) {
    std::vector<Disc> ends;
    for (const Line& line : d.lines) {
      ends.push_back({line.from, line.color});
      ends.push_back({line.to, line.color});
    }
    draw(program(kLineVertex, kLineFragment), GL_LINES, clip, ends.data(), ends.size() * sizeof(Disc), static_cast<GLsizei>(ends.size()));
  }
  glFinish();
  if (glGetError() != GL_NO_ERROR) fail("OpenGL reports an error");
  fill_background(d, pixels);
  return pixels;
}

std::vector<std::uint8_t> rasterize(const FlatDrawing& d) {
  std::vector<std::uint8_t> pixels(static_cast<std::size_t>(d.width) * static_cast<std::size_t>(d.height) * 4);
  if (d.discs.empty()) return pixels;
  const Context context = make_current(pixels, d.width, d.height);
  glViewport(0, 0, d.width, d.height);
  glClearColor(0, 0, 0, 0);
  glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
  glEnable(GL_DEPTH_TEST);
  bind(d.discs.data(), d.discs.size() * sizeof(Disc), true);
  const GLuint shader = program(kFlatVertex, kFlatFragment);
  glUseProgram(shader);
  glUniform2f(glGetUniformLocation(shader, "size"), static_cast<float>(d.width), static_cast<float>(d.height));
  glUniform1f(glGetUniformLocation(shader, "radius"), d.radius);
  glDrawArraysInstanced(GL_TRIANGLE_STRIP, 0, 4, static_cast<GLsizei>(d.discs.size()));
  glFinish();
  if (glGetError() != GL_NO_ERROR) fail("OpenGL reports an error");
  return pixels;
}

}  // namespace render::raster
