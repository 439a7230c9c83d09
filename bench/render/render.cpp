// What pictures cost: rays of the path tracer against Embree alone, a frame of water, a frame of grains, a preview.
#include <benchmark/benchmark.h>

#include <cmath>
#include <numbers>

#include "base/ledger.h"
#include "bench/render/bare_rays.h"
#include "render/render.h"
#include "render/sampling/sampler.h"

namespace {

using base::Vec3;
using base::Vec3f;

constexpr int kThreads = 2;

/// A closed bumpy ball about (0, 0, 0), of two triangles a quad.
surface::Mesh bumpy_ball(std::uint32_t sides, std::uint32_t rings) {
  surface::Mesh mesh;
  for (std::uint32_t i = 0; i <= rings; ++i)
    for (std::uint32_t j = 0; j < sides; ++j) {
      const double theta = std::numbers::pi * i / rings, phi = 2 * std::numbers::pi * j / sides;
      const Vec3 n(std::sin(theta) * std::cos(phi), std::sin(theta) * std::sin(phi), std::cos(theta));
      mesh.position.push_back(((1 + 0.01 * std::sin(theta) * std::sin(24 * theta) * std::sin(16 * phi)) * n).cast<float>());
      mesh.normal.push_back(n.cast<float>());
      mesh.velocity.push_back(Vec3f::Zero());
    }
  for (std::uint32_t i = 0; i < rings; ++i)
    for (std::uint32_t j = 0; j < sides; ++j)
      mesh.quads.push_back({i * sides + j, (i + 1) * sides + j, (i + 1) * sides + (j + 1) % sides, i * sides + (j + 1) % sides});
  return mesh;
}

/// A sheet of (nx + 1)(ny + 1) vertices; at(s, t) gives places for s and t from 0 to 1, and normals by differences.
template <class Place>
void add_sheet(surface::Mesh& mesh, std::uint32_t nx, std::uint32_t ny, const Place& at) {
  const auto first = static_cast<std::uint32_t>(mesh.position.size());
  constexpr double kStep = 1e-4;
  for (std::uint32_t j = 0; j <= ny; ++j)
    for (std::uint32_t i = 0; i <= nx; ++i) {
      const double s = double(i) / nx, t = double(j) / ny;
      mesh.position.push_back(at(s, t).template cast<float>());
      mesh.normal.push_back((at(s + kStep, t) - at(s - kStep, t)).cross(at(s, t + kStep) - at(s, t - kStep)).normalized().template cast<float>());
      mesh.velocity.push_back(Vec3f::Zero());
    }
  for (std::uint32_t j = 0; j < ny; ++j)
    for (std::uint32_t i = 0; i < nx; ++i) {
      const std::uint32_t a = first + j * (nx + 1) + i;
      mesh.quads.push_back({a, a + 1, a + nx + 2, a + nx + 1});
    }
}

/// A tank of 2 x 1 m with waves, and a spray of drops above it.
surface::Mesh rough_water() {
  surface::Mesh mesh;
  const auto height = [](double x, double y) {
    return 0.4 + 0.05 * std::sin(5 * x + 2 * y) + 0.03 * std::sin(9 * y - 4 * x + 1) + 0.012 * std::sin(23 * x + 17 * y) +
           0.004 * std::sin(61 * x - 47 * y);
  };
  add_sheet(mesh, 560, 280, [&](double s, double t) { return Vec3(2 * s, t, height(2 * s, t)); });
  add_sheet(mesh, 560, 1, [&](double s, double t) { return Vec3(2 * s, 0, t * height(2 * s, 0)); });
  add_sheet(mesh, 560, 1, [&](double s, double t) { return Vec3(2 - 2 * s, 1, t * height(2 - 2 * s, 1)); });
  add_sheet(mesh, 280, 1, [&](double s, double t) { return Vec3(2, s, t * height(2, s)); });
  add_sheet(mesh, 280, 1, [&](double s, double t) { return Vec3(0, 1 - s, t * height(0, 1 - s)); });
  add_sheet(mesh, 1, 1, [&](double s, double t) { return Vec3(2 * t, s, -0.01); });
  for (int drop = 0; drop < 300; ++drop) {
    const auto u = [&](int k) { return static_cast<double>(render::sampling::mix(static_cast<std::uint64_t>(8 * drop + k + 1)) >> 40) * 0x1p-24; };
    const Vec3 middle(0.3 + 1.4 * u(0), 0.2 + 0.6 * u(1), 0.55 + 0.4 * u(2) * u(3));
    const double radius = 0.004 + 0.014 * u(4) * u(5);
    add_sheet(mesh, 24, 12, [&](double s, double t) {
      const double theta = std::numbers::pi * (1 - (0.002 + 0.996 * t)), phi = 2 * std::numbers::pi * s;
      return Vec3(middle + radius * Vec3(std::sin(theta) * std::cos(phi), std::sin(theta) * std::sin(phi), std::cos(theta)));
    });
  }
  return mesh;
}

/// Grains of a heap, closely packed.
render::Grains heap(std::size_t count) {
  render::Grains grains;
  const double spacing = 0.985 * std::cbrt(std::numbers::pi / 3 * 0.6 / static_cast<double>(count));  // a cone of radius 1 m, 0.6 m high
  grains.radius = 0.62 * spacing;
  for (double z = 0.5 * spacing; grains.position.size() < count && z < 1; z += spacing)
    for (double y = -1; y < 1; y += spacing)
      for (double x = -1; x < 1 && grains.position.size() < count; x += spacing) {
        if (std::hypot(x, y) > 1 - z / 0.6) continue;
        const auto u = [&](int k) {
          return static_cast<double>(render::sampling::mix(3 * grains.position.size() + static_cast<std::uint64_t>(k) + 1) >> 40) * 0x1p-24 - 0.5;
        };
        grains.id.push_back(static_cast<std::int64_t>(grains.position.size()));
        grains.velocity.push_back(Vec3f::Zero());
        grains.position.push_back((Vec3(x, y, z) + 0.7 * spacing * Vec3(u(0), u(1), u(2))).cast<float>());
      }
  return grains;
}

/// Share of the picture that shows neither the sky nor the ground.
double cover(const render::Image& image) {
  const std::size_t channels = image.channels.size();
  const auto id = static_cast<std::size_t>(std::find(image.channels.begin(), image.channels.end(), "id") - image.channels.begin());
  std::size_t shown = 0;
  for (std::size_t i = id; i < image.pixels.size(); i += channels) shown += image.pixels[i] >= 2;
  return static_cast<double>(shown) / static_cast<double>(image.pixels.size() / channels);
}

double seconds(const base::Ledger& ledger, const char* pass) { return ledger.passes().find(pass)->second.seconds; }

render::Setting frame_setting(std::int64_t width, std::int64_t height, std::int64_t spp) {
  render::Setting setting;
  setting.options.width = width;
  setting.options.height = height;
  setting.options.spp = spp;
  return setting;
}

/// White diffuse walls, and a light in the middle that all of them see: a path is 1 + 8 rays that are intersected and 8 shadow rays.
void trace_rays(benchmark::State& state) {
  constexpr std::int64_t kSize = 256, kSamples = 16, kBounces = 8;
  const surface::Mesh mesh = bumpy_ball(640, static_cast<std::uint32_t>(state.range(0) / 1280));
  render::Setting setting = frame_setting(kSize, kSize, kSamples);
  setting.domain = {Vec3(-1, -1, -1), Vec3(1, 1, 1)};
  setting.options.ground = "none";
  setting.options.bounces = kBounces;
  setting.looks["water"] = {.model = "diffuse", .color = Vec3::Ones()};
  setting.lights = {{.kind = "sphere", .position = Vec3(0, 0, 0), .radius = 0.05}};
  setting.camera = {.position = Vec3(0.1, -0.5, 0.2), .target = Vec3(0, 0.5, 0), .fov = 90};
  render::PathTracer tracer(setting, kThreads);
  double best = 0, bare = 0;
  for (auto _ : state) {
    base::Ledger ledger;
    tracer.trace(mesh, 1, ledger);
    best = std::max(best, static_cast<double>(kSize * kSize * kSamples * (1 + 2 * kBounces)) / seconds(ledger, "trace"));
    bare = std::max(bare, bench::bare_rays_per_second(mesh, Vec3f::Zero(), kThreads));
  }
  state.counters["shaded_rays_per_second"] = best;
  state.counters["bare_rays_per_second"] = bare;
  state.counters["share"] = best / bare;
}

void water_frame(benchmark::State& state) {
  const surface::Mesh mesh = rough_water();
  render::Setting setting = frame_setting(1280, 720, state.range(0));
  setting.domain = {Vec3(0, 0, 0), Vec3(2, 1, 1.6)};
  setting.camera = {.position = Vec3(2.6, -1.9, 1.35), .target = Vec3(1, 0.45, 0.3), .fov = 27};
  render::PathTracer tracer(setting, kThreads);
  for (auto _ : state) {
    base::Ledger ledger;
    const render::Image image = tracer.trace(mesh, 1, ledger);
    state.counters["cover"] = cover(image);
    state.counters["seconds_bvh"] = seconds(ledger, "bvh");
    state.counters["seconds_trace"] = seconds(ledger, "trace");
  }
}

void grains_frame(benchmark::State& state) {
  const render::Grains grains = heap(static_cast<std::size_t>(state.range(0)));
  render::Setting setting = frame_setting(1280, 720, 64);
  setting.domain = {Vec3(-1, -1, 0), Vec3(1, 1, 1)};
  setting.body_looks = {"sand"};
  setting.camera = {.position = Vec3(0, -2.6, 0.9), .target = Vec3(0, 0, 0.2), .fov = 24};
  render::PathTracer tracer(setting, kThreads);
  for (auto _ : state) {
    base::Ledger ledger;
    const render::Image image = tracer.trace({}, grains, 1, ledger);
    state.counters["cover"] = cover(image);
    state.counters["seconds_bvh"] = seconds(ledger, "bvh");
    state.counters["seconds_trace"] = seconds(ledger, "trace");
  }
}

void preview_points(benchmark::State& state) {
  const render::Grains grains = heap(static_cast<std::size_t>(state.range(0)));
  sim::Frame frame;
  frame.position = grains.position;
  frame.velocity = grains.position;
  frame.id = grains.id;
  frame.pscale = grains.radius;
  render::Setting setting = frame_setting(1280, 720, 1);
  setting.domain = {Vec3(-1, -1, 0), Vec3(1, 1, 1)};
  for (auto _ : state) benchmark::DoNotOptimize(render::preview(setting, frame, "bench", 1));
}

BENCHMARK(trace_rays)->Name("trace")->Arg(512000)->Iterations(1)->Unit(benchmark::kMillisecond);
BENCHMARK(water_frame)->Name("frame/water")->Arg(64)->Iterations(1)->Unit(benchmark::kMillisecond);
BENCHMARK(grains_frame)->Name("frame/grains")->Arg(4000000)->Iterations(1)->Unit(benchmark::kMillisecond);
BENCHMARK(preview_points)->Name("preview")->Arg(1000000)->Unit(benchmark::kMillisecond);

}  // namespace
