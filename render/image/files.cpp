// Image files; the only file that knows OpenImageIO.
#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>
#include <zlib.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <string_view>

#include "base/atomic_file.h"
#include "base/error.h"
#include "base/text.h"
#include "render/image/tone.h"
#include "render/render.h"

namespace render {
namespace {

constexpr float kLargestHalf = 65504;

/// Colours are halves; what measures the scene keeps its precision.
bool is_color(const std::string& channel) {
  return channel == "R" || channel == "G" || channel == "B" || channel == "A" || channel.starts_with("albedo.") || channel.starts_with("denoised.");
}

void check_finite(const Image& image, const std::filesystem::path& path) {
  const std::size_t channels = image.channels.size();
  for (std::size_t i = 0; i < image.pixels.size(); ++i) {
    if (std::isfinite(image.pixels[i])) continue;
    const auto pixel = static_cast<std::int64_t>(i / channels);
    throw base::Error({.code = base::Exit::fault,
                       .message = path.string() + ": pixel (" + std::to_string(pixel % image.width) + ", " + std::to_string(pixel / image.width) +
                                  "), channel " + image.channels[i % channels] + " is not finite"});
  }
}

/// Of a file in memory: the library has a word for all but a lack of that.
[[noreturn]] void fail_to_encode(const std::filesystem::path& path, const std::string& reason) {
  if (reason.empty()) throw std::bad_alloc();
  base::throw_io(path.string(), reason);
}

/// `pixels` as `spec` says, as a file of the kind that the path names. In memory: the library takes no notice of a disk that is full when the last
/// of a file goes out.
std::string encoded(const std::filesystem::path& path, const OIIO::ImageSpec& spec, OIIO::TypeDesc type, const void* pixels) {
  OIIO::Filesystem::IOVecOutput file;
  const auto out = OIIO::ImageOutput::create(path.string(), &file);
  if (!out) fail_to_encode(path, OIIO::geterror());
  if (!out->open(path.string(), spec) || !out->write_image(type, pixels) || !out->close()) fail_to_encode(path, out->geterror());
  const std::vector<unsigned char>& bytes = file.buffer();
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

void write(const std::filesystem::path& path, const OIIO::ImageSpec& spec, OIIO::TypeDesc type, const void* pixels) {
  base::write_text_atomically(path, encoded(path, spec, type, pixels));
}

/// Noise of one code value that is the same for a pixel in every frame: it breaks up the steps of a slow gradient.
float dither(std::uint32_t x, std::uint32_t y, std::uint32_t c) {
  std::uint32_t h = x * 0x9e3779b1u ^ y * 0x85ebca77u ^ c * 0xc2b2ae3du;
  h ^= h >> 15;
  h *= 0x2c1b3c6du;
  h ^= h >> 12;
  h *= 0x297a2d39u;
  h ^= h >> 15;
  return static_cast<float>(h >> 8) * 0x1p-24f;
}

/// The first line of the library's message, without the path it may start with.
std::string reason_of(const std::string& message) {
  return message.empty() ? "cannot be read" : message.substr(0, message.find('\n'));
}

/// Every chunk of a PNG has a checksum; damage is found here, because libpng prints lines of its own about it.
void check_png(const std::filesystem::path& path) {
  constexpr std::string_view kMark = "\x89PNG\r\n\x1a\n";
  const std::string bytes = base::read_file(path);
  const std::string_view file = bytes;
  if (!file.starts_with(kMark)) base::throw_input(path.string(), file.empty() ? "the file is empty" : "not a PNG file");
  const auto number = [&](std::size_t at) {
    std::uint32_t value = 0;
    for (std::size_t i = 0; i < 4; ++i) value = value << 8 | static_cast<unsigned char>(file[at + i]);
    return value;
  };
  for (std::size_t at = kMark.size(); at + 12 <= file.size();) {   // length, name, data, checksum
    const std::size_t length = number(at);
    if (length > file.size() - at - 12) break;
    if (crc32_z(0, reinterpret_cast<const Bytef*>(file.data()) + at + 4, length + 4) != number(at + 8 + length))
      base::throw_input(path.string(), "the file is damaged (a checksum does not match)");
    if (file.substr(at + 4, 4) == "IEND") return;
    at += 12 + length;
  }
  base::throw_input(path.string(), "the file is cut short or damaged");
}

std::unique_ptr<OIIO::ImageInput> open(const std::filesystem::path& path) {
  constexpr std::string_view kKinds[] = {".exr", ".hdr", ".png", ".jpg", ".jpeg", ".tif", ".tiff"};   // others' readers may end the program
  const std::string kind = base::extension_of(path);
  if (std::find(std::begin(kKinds), std::end(kKinds), kind) == std::end(kKinds))
    base::throw_input(path.string(), "is no picture that is read: must end in .exr, .hdr, .png, .jpg or .tif");
  if (kind == ".png") check_png(path);
  auto in = OIIO::ImageInput::open(path.string());
  if (!in) base::throw_input(path.string(), reason_of(OIIO::geterror()));
  return in;
}

/// Number of values of a flat image that is small enough to be read.
std::size_t checked_values(const std::filesystem::path& path, const OIIO::ImageSpec& spec) {
  constexpr std::uint64_t kMost = std::uint64_t(18) << 28;   // as many as a picture of 16384 x 16384 with all channels has
  if (spec.width < 1 || spec.height < 1 || spec.nchannels < 1 || spec.depth > 1 || spec.deep) base::throw_input(path.string(), "not a flat image");
  const auto pixels = static_cast<std::uint64_t>(spec.width) * static_cast<std::uint64_t>(spec.height);
  if (pixels > kMost / static_cast<std::uint64_t>(spec.nchannels))
    base::throw_input(path.string(), "too large: " + std::to_string(spec.width) + "x" + std::to_string(spec.height) + " with " +
                                         std::to_string(spec.nchannels) + " channels");
  const std::uint64_t values = pixels * static_cast<std::uint64_t>(spec.nchannels);
  std::error_code none;
  if (values / 4096 > std::filesystem::file_size(path, none))
    base::throw_input(path.string(), "the file is too short for its " + std::to_string(spec.width) + "x" + std::to_string(spec.height) + " pixels");
  return values;   // no compression makes less than a byte of 4096 values
}

std::size_t channel_index(const Image& image, const std::string& name) {
  return static_cast<std::size_t>(std::find(image.channels.begin(), image.channels.end(), name) - image.channels.begin());
}

}  // namespace

void write_exr(const std::filesystem::path& path, const Image& image, const Stamp& stamp, base::Ledger& ledger) {
  const auto pass = ledger.pass("write_image", static_cast<std::int64_t>(image.pixels.size() * sizeof(float)));
  check_finite(image, path);
  OIIO::ImageSpec spec(static_cast<int>(image.width), static_cast<int>(image.height), static_cast<int>(image.channels.size()), OIIO::TypeFloat);
  spec.channelnames = image.channels;
  for (const std::string& channel : image.channels) spec.channelformats.push_back(is_color(channel) ? OIIO::TypeHalf : OIIO::TypeFloat);
  spec.attribute("compression", "zip");
  spec.attribute("oiio:ColorSpace", "Linear");
  spec.attribute("DateTime", "1970:01:01 00:00:00");   // else the library puts the time of day, and the same picture has other bytes
  spec.attribute("polypic:frame", static_cast<int>(stamp.frame));
  spec.attribute("polypic:time", static_cast<float>(stamp.time));
  spec.attribute("polypic:shot", stamp.shot);
  spec.attribute("polypic:hash", stamp.hash);
  spec.attribute("polypic:spp", static_cast<int>(stamp.spp));
  spec.attribute("polypic:version", stamp.version);
  if (!stamp.reproducible) spec.attribute("polypic:reproducible", 0);
  std::vector<float> pixels = image.pixels;
  for (std::size_t i = 0; i < pixels.size(); ++i)
    if (is_color(image.channels[i % image.channels.size()])) pixels[i] = std::clamp(pixels[i], -kLargestHalf, kLargestHalf);
  write(path, spec, OIIO::TypeFloat, pixels.data());
}

void write_png(const std::filesystem::path& path, const Image& image, const Options& options, bool display_referred, base::Ledger& ledger) {
  const auto pass = ledger.pass("write_image", image.width * image.height * 3);
  check_finite(image, path);
  const std::size_t channels = image.channels.size();
  const std::string layer = !display_referred && options.denoise == "picture" ? "denoised." : "";
  const std::array<std::size_t, 3> rgb{channel_index(image, layer + "R"), channel_index(image, layer + "G"), channel_index(image, layer + "B")};
  const float gain = static_cast<float>(std::exp2(options.exposure));
  std::vector<std::uint8_t> bytes(static_cast<std::size_t>(image.width * image.height) * 3);
  for (std::size_t i = 0; i < bytes.size() / 3; ++i) {
    const float* in = &image.pixels[i * channels];
    base::Vec3f v(in[rgb[0]], in[rgb[1]], in[rgb[2]]);
    if (!display_referred) v *= gain;
    if (!display_referred && options.view == "filmic") v = image::filmic(v);
    for (std::size_t c = 0; c < 3; ++c) {
      const float shown = v[static_cast<int>(c)];
      const auto x = static_cast<std::uint32_t>(i % static_cast<std::size_t>(image.width)),
                 y = static_cast<std::uint32_t>(i / static_cast<std::size_t>(image.width));
      const float code = display_referred ? 255 * shown + 0.5f : 255 * image::srgb_code(shown) + dither(x, y, static_cast<std::uint32_t>(c));
      bytes[i * 3 + c] = static_cast<std::uint8_t>(std::clamp(code, 0.0f, 255.0f));
    }
  }
  OIIO::ImageSpec spec(static_cast<int>(image.width), static_cast<int>(image.height), 3, OIIO::TypeUInt8);
  spec.attribute("oiio:ColorSpace", "sRGB");
  write(path, spec, OIIO::TypeUInt8, bytes.data());
}

Image read_image(const std::filesystem::path& path) {
  const auto in = open(path);
  const OIIO::ImageSpec& spec = in->spec();
  Image image{.width = spec.width, .height = spec.height, .channels = spec.channelnames, .pixels = {}};
  image.pixels.resize(checked_values(path, spec));
  if (!in->read_image(0, 0, 0, spec.nchannels, OIIO::TypeFloat, image.pixels.data())) base::throw_input(path.string(), reason_of(in->geterror()));
  return image;
}

std::string jpeg(const Image& image, int quality) {
  const std::size_t channels = image.channels.size();
  std::vector<std::uint8_t> bytes(static_cast<std::size_t>(image.width * image.height) * 3);
  for (std::size_t i = 0; i < bytes.size(); ++i)
    bytes[i] = static_cast<std::uint8_t>(std::clamp(255 * image.pixels[i / 3 * channels + i % 3] + 0.5f, 0.0f, 255.0f));
  OIIO::ImageSpec spec(static_cast<int>(image.width), static_cast<int>(image.height), 3, OIIO::TypeUInt8);
  spec.attribute("Compression", "jpeg:" + std::to_string(quality));
  return encoded("picture.jpg", spec, OIIO::TypeUInt8, bytes.data());
}

ImageInfo info(const std::filesystem::path& path) {
  const Image image = read_image(path);
  ImageInfo result{.width = image.width, .height = image.height, .channels = image.channels, .ranges = {}, .not_finite = 0, .metadata = {}};
  result.ranges.resize(image.channels.size());
  for (std::size_t i = 0; i < image.pixels.size(); ++i) {
    auto& range = result.ranges[i % image.channels.size()];
    const double value = static_cast<double>(image.pixels[i]);
    if (!std::isfinite(value)) ++result.not_finite;
    else if (!range) range = {value, value};
    else range = {std::min((*range)[0], value), std::max((*range)[1], value)};
  }
  const auto in = open(path);
  for (const auto& attribute : in->spec().extra_attribs) result.metadata.push_back({attribute.name().string(), attribute.get_string()});
  return result;
}

}  // namespace render
