// Files, views and the preview.
#include <OpenImageIO/imagebuf.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <unistd.h>

#include <csignal>
#include <filesystem>

#include "base/error.h"
#include "render/image/tone.h"
#include "render/view/view.h"
#include "tests/render_scenes.h"

namespace {

using namespace tests;
namespace fs = std::filesystem;

class Images : public testing::Test {
 protected:
  Images() : folder_(fs::temp_directory_path() / ("polypic_images_" + std::to_string(::getpid()))) { fs::create_directories(folder_); }
  ~Images() override { fs::remove_all(folder_); }
  fs::path folder_;
  base::Ledger ledger_;
};

/// Bands of a pure colour: value in R, G and B.
render::Image grey_image(float value) {
  render::Image image{.width = 32, .height = 18, .channels = {"R", "G", "B", "A"}, .pixels = {}};
  for (int i = 0; i < 32 * 18; ++i) image.pixels.insert(image.pixels.end(), {value, value, value, 1});
  return image;
}

std::string metadata(const render::ImageInfo& info, const std::string& name) {
  for (const auto& [key, value] : info.metadata)
    if (key == name) return value;
  return "missing";
}

sim::Frame one_particle(const Vec3f& at) {
  sim::Frame frame;
  frame.position = {at};
  frame.velocity = {Vec3f(1, 0, 0)};
  frame.id = {0};
  frame.pscale = 0.1;
  return frame;
}

/// Middle of the pixels that the particle changed.
Eigen::Vector2d middle_of_change(const render::Image& with, const render::Image& without) {
  Eigen::Vector2d sum(0, 0);
  double count = 0;
  for (std::int64_t i = 0; i < with.width * with.height; ++i)
    if (with.pixels[static_cast<std::size_t>(i * 4)] != without.pixels[static_cast<std::size_t>(i * 4)]) {
      sum += Eigen::Vector2d(static_cast<double>(i % with.width) + 0.5, static_cast<double>(i / with.width) + 0.5);
      ++count;
    }
  return sum / count;
}

}  // namespace

// A disk that fills up with the very last bytes of a file: a limit on its size fails at the same call.
TEST_F(Images, AreWholeOrNotThere) {
  const auto handler = std::signal(SIGXFSZ, SIG_IGN);
  for (const std::string name : {"a.png", "a.exr"}) {
    const fs::path path = folder_ / name;
    const auto write = [&](float value) {
      if (name == "a.png") render::write_png(path, grey_image(value), {}, true, ledger_);
      else render::write_exr(path, grey_image(value), {}, ledger_);
    };
    write(0.25f);
    const auto size = fs::file_size(path);
    rlimit was{}, small{};
    getrlimit(RLIMIT_FSIZE, &was);
    small = was;
    small.rlim_cur = size - 3;
    setrlimit(RLIMIT_FSIZE, &small);
    std::string said = "no error";
    try {
      write(0.25f);
    } catch (const base::Error& e) {
      EXPECT_EQ(e.complaint().code, base::Exit::io);
      said = e.what();
    }
    setrlimit(RLIMIT_FSIZE, &was);
    EXPECT_EQ(said, path.string() + ": File too large");
    EXPECT_EQ(fs::file_size(path), size) << name;
    fs::remove(path);
    EXPECT_TRUE(fs::is_empty(folder_)) << name;
  }
  std::signal(SIGXFSZ, handler);
}

TEST_F(Images, KeepChannelsPixelsAndMetadataInAnExrFile) {
  render::Setting setting = empty_setting();
  setting.lights = {};
  surface::Mesh ball = sphere_mesh(Vec3(0.3, 0, 0.5), 0.4);
  for (Vec3f& v : ball.velocity) v = Vec3f(1, 2, 3);
  const render::Image image = traced(setting, ball);
  const fs::path path = folder_ / "beauty.0007.exr";
  render::write_exr(path, image, {.shot = "dam_break", .hash = "0123456789abcdef", .version = "0.1.0", .frame = 7, .spp = 16, .time = 0.25}, ledger_);
  const render::ImageInfo info = render::info(path);
  EXPECT_EQ(info.width, 64);
  EXPECT_EQ(info.height, 36);
  EXPECT_EQ(metadata(info, "polypic:frame"), "7");
  EXPECT_EQ(metadata(info, "polypic:time"), "0.25");
  EXPECT_EQ(metadata(info, "polypic:shot"), "dam_break");
  EXPECT_EQ(metadata(info, "polypic:hash"), "0123456789abcdef");
  EXPECT_EQ(metadata(info, "polypic:spp"), "16");
  EXPECT_EQ(metadata(info, "polypic:version"), "0.1.0");
  OIIO::ImageBuf file(path.string());
  ASSERT_TRUE(file.read(0, 0, true, OIIO::TypeFloat));
  ASSERT_EQ(file.nchannels(), static_cast<int>(image.channels.size()));
  for (std::size_t c = 0; c < image.channels.size(); ++c) {
    const int channel = file.spec().channelindex(image.channels[c]);
    ASSERT_GE(channel, 0) << image.channels[c];
    const bool half = file.nativespec().channelformat(channel) == OIIO::TypeHalf;
    EXPECT_EQ(half, c < 7) << image.channels[c];
    float largest = 0;
    for (int y = 0; y < 36; ++y)
      for (int x = 0; x < 64; ++x) {
        const float written = image.pixels[static_cast<std::size_t>(y * 64 + x) * image.channels.size() + c];
        EXPECT_NEAR(file.getchannel(x, y, 0, channel), written, half ? 5e-4 * std::abs(written) + 1e-7 : 0);  // 11 bits
        largest = std::max(largest, std::abs(written));
      }
    EXPECT_GT(largest, 0) << image.channels[c];
  }
  EXPECT_EQ(ledger_.passes().at("write_image").calls, 1);
}

TEST_F(Images, AreNeverWrittenWithAPixelThatIsNotFinite) {
  render::Image image = grey_image(0.5f);
  image.pixels[4 * (3 * 32 + 5) + 1] = std::nanf("");
  for (const char* name : {"a.exr", "a.png"}) {
    try {
      name[2] == 'e' ? render::write_exr(folder_ / name, image, {}, ledger_) : render::write_png(folder_ / name, image, {}, false, ledger_);
      FAIL() << name;
    } catch (const base::Error& e) {
      EXPECT_EQ(e.complaint().code, base::Exit::fault);
      EXPECT_NE(std::string(e.what()).find("pixel (5, 3), channel G"), std::string::npos) << e.what();
    }
  }
  EXPECT_TRUE(fs::is_empty(folder_));
}

TEST_F(Images, ShowMidGreyAtItsPlaceInBothViews) {
  for (const char* view : {"filmic", "srgb"}) {
    render::Options options;
    options.view = view;
    options.exposure = 1;
    const fs::path path = folder_ / (std::string(view) + ".png");  // OpenImageIO remembers files by name
    render::write_png(path, grey_image(0.09f), options, false, ledger_);
    OIIO::ImageBuf file(path.string());
    ASSERT_EQ(file.nchannels(), 3);
    EXPECT_NEAR(255 * file.getchannel(7, 7, 0, 1), 255 * render::image::srgb_code(0.18f), 1) << view;  // dither
  }
}

TEST_F(Images, OfAPreviewGoIntoAPngAsTheyAre) {
  render::write_png(folder_ / "a.png", grey_image(128 / 255.0f), {}, true, ledger_);
  OIIO::ImageBuf file((folder_ / "a.png").string());
  EXPECT_EQ(std::lround(255 * file.getchannel(3, 3, 0, 0)), 128);
}

TEST_F(Images, ThatCannotBeReadAreTheUsersMistake) {
  try {
    render::info(folder_ / "missing.exr");
    FAIL();
  } catch (const base::Error& e) {
    EXPECT_EQ(e.complaint().code, base::Exit::user);
    EXPECT_NE(std::string(e.what()).find("missing.exr: "), std::string::npos) << e.what();
  }
}

// Brighter in, brighter out, and never out of range: over twelve stops each way.
TEST(Filmic, RisesFromBlackToWhite) {
  float before = -1;
  for (float stop = -12; stop <= 12; stop += 0.25f) {
    const float shown = render::image::filmic(Vec3f::Constant(0.18f * std::exp2(stop))).x();
    EXPECT_GT(shown, before);
    EXPECT_LE(shown, 1);
    before = shown;
  }
  EXPECT_GT(before, 0.99f);
}

TEST(View, ShowsAllCornersOfTheDomainWhenNoCameraIsNamed) {
  for (const Vec3& upper : {Vec3(1, 1, 1), Vec3(2, 1, 1), Vec3(0.1, 5, 0.3), Vec3(20, 10, 4)}) {
    const base::Box domain{Vec3(-0.5, 0.2, -1), upper};
    const render::view::View v = render::view::resolve({}, domain, 960, 540);
    double widest = 0;
    for (int i = 0; i < 8; ++i) {
      const Vec3 p =
          Vec3((i & 1 ? domain.upper : domain.lower).x(), (i & 2 ? domain.upper : domain.lower).y(), (i & 4 ? domain.upper : domain.lower).z()) -
          v.position;
      ASSERT_GT(p.dot(v.forward), 0);
      const double x = std::abs(p.dot(v.right)) / p.dot(v.forward) / v.tan_x, y = std::abs(p.dot(v.up)) / p.dot(v.forward) / v.tan_y;
      EXPECT_LT(std::max(x, y), 0.95);
      widest = std::max({widest, x, y});
    }
    EXPECT_GT(widest, 0.9);  // and no farther away than that takes
  }
}

TEST(Preview, IsTheSamePictureTwice) {
  render::Setting setting = empty_setting();
  setting.options.width = 320;
  setting.options.height = 180;
  const sim::Frame frame = one_particle(Vec3f(0, 0, 0.5f));
  const render::Image first = render::preview(setting, frame, "frame 1", 2), second = render::preview(setting, frame, "frame 1", 2);
  EXPECT_EQ(first.pixels, second.pixels);
  EXPECT_NE(first.pixels, render::preview(setting, frame, "frame 2", 2).pixels) << "the caption is part of it";
}

// Where the path tracer's camera sees a point, the preview draws it: neither flipped nor shifted.
TEST(Preview, DrawsAParticleWhereTheCameraSeesIt) {
  render::Setting setting = empty_setting();
  setting.options.width = 320;
  setting.options.height = 180;
  const render::view::View v = render::view::resolve(setting.camera, setting.domain, 320, 180);
  const render::Image without = render::preview(setting, {}, "", 2);
  for (const Vec3f& at : {Vec3f(0.2f, 0.1f, 0.8f), Vec3f(-0.5f, 0.3f, 0.2f), Vec3f(0.4f, -0.4f, 0.3f)}) {
    const Vec3 p = at.cast<double>() - v.position;
    const double x = (1 + p.dot(v.right) / p.dot(v.forward) / v.tan_x) * 160, y = (1 - p.dot(v.up) / p.dot(v.forward) / v.tan_y) * 90;
    const Eigen::Vector2d drawn = middle_of_change(render::preview(setting, one_particle(at), "", 2), without);
    EXPECT_NEAR(drawn.x(), x, 1);
    EXPECT_NEAR(drawn.y(), y, 1);
  }
}
