// Two images, value by value.
#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "render/render.h"

namespace render {
namespace {

/// Channels that people see; all of them in an image that has no colours.
std::vector<std::size_t> shown_channels(const Image& image) {
  std::vector<std::size_t> colors, all;
  for (std::size_t c = 0; c < image.channels.size(); ++c) {
    all.push_back(c);
    if (const std::string& name = image.channels[c]; name == "R" || name == "G" || name == "B") colors.push_back(c);
  }
  return colors.empty() ? all : colors;
}

double distance(float a, float b) { return std::abs(static_cast<double>(a) - static_cast<double>(b)); }

/// Peak signal to noise [dB] of these channels; the peak is white, or what is brighter. Empty where they are the same.
std::optional<double> noise_ratio(const Image& a, const ImageDifference& difference, const std::vector<std::size_t>& shown) {
  base::Differences values;
  for (const std::size_t c : shown) values.add(difference.by_channel[c]);
  if (!(values.squares > 0)) return {};
  float peak = 1;
  for (std::size_t i = 0; i < a.pixels.size(); i += a.channels.size())
    for (const std::size_t c : shown)
      if (std::isfinite(a.pixels[i + c])) peak = std::max(peak, a.pixels[i + c]);
  return 20 * std::log10(static_cast<double>(peak) / values.rms());
}

/// The largest of 1, 2 and 5 times a power of ten that brings `largest` to 1 at most.
double round_gain(double largest) {
  if (!(largest > 0)) return 1;
  const double decade = std::pow(10.0, std::floor(std::log10(1 / largest)));
  for (const double step : {5.0, 2.0})
    if (step * decade * largest <= 1) return step * decade;
  return decade;
}

/// Colours that differ are shown as colours; where only one other channel does, it is shown as grey.
std::vector<std::size_t> channels_to_draw(const Image& image, const ImageDifference& difference) {
  const std::vector<std::size_t> shown = shown_channels(image);
  const auto differs = [&](std::size_t c) { return difference.by_channel[c].largest > 0; };
  if (shown.size() == 3 && std::any_of(shown.begin(), shown.end(), differs)) return shown;
  for (std::size_t c = 0; c < image.channels.size(); ++c)
    if (differs(c)) return {c};
  return {shown.front()};
}

}  // namespace

ImageDifference compare(const Image& a, const Image& b, double limit) {
  if (a.width != b.width || a.height != b.height || a.channels != b.channels)
    throw std::logic_error("images of different sizes or channels are compared");
  const std::size_t channels = a.channels.size();
  ImageDifference result;
  result.by_channel.assign(channels, {.limit = limit});
  for (std::size_t i = 0; i < a.pixels.size(); i += channels) {
    bool over = false;
    for (std::size_t c = 0; c < channels; ++c) {
      const double d = distance(a.pixels[i + c], b.pixels[i + c]);
      result.by_channel[c].add(d);
      over = over || !(d <= limit);   // a NaN too
    }
    ++result.pixels;
    if (over) ++result.pixels_over;
  }
  result.values.limit = limit;
  for (const base::Differences& channel : result.by_channel) result.values.add(channel);
  result.psnr = noise_ratio(a, result, shown_channels(a));
  return result;
}

DifferencePicture difference_picture(const Image& a, const Image& b, const ImageDifference& difference) {
  const std::vector<std::size_t> drawn = channels_to_draw(a, difference);
  DifferencePicture picture;
  double largest = 0;
  for (const std::size_t c : drawn) {
    largest = std::max(largest, difference.by_channel[c].largest);
    picture.shows.push_back(a.channels[c]);
  }
  picture.gain = round_gain(largest);
  picture.image = {.width = a.width, .height = a.height, .channels = {"R", "G", "B"}, .pixels = {}};
  picture.image.pixels.reserve(static_cast<std::size_t>(a.width * a.height) * 3);
  for (std::size_t i = 0; i < a.pixels.size(); i += a.channels.size()) {
    float rgb[3];
    for (std::size_t k = 0; k < 3; ++k) {
      const std::size_t c = drawn[drawn.size() == 3 ? k : 0];
      rgb[k] = static_cast<float>(picture.gain * distance(a.pixels[i + c], b.pixels[i + c]));
    }
    if (!std::isfinite(rgb[0] + rgb[1] + rgb[2])) rgb[0] = 1, rgb[1] = 0, rgb[2] = 1;   // magenta: a NaN
    picture.image.pixels.insert(picture.image.pixels.end(), rgb, rgb + 3);
  }
  return picture;
}

}  // namespace render
