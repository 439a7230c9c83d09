#include "render/sampling/sampler.h"

#include <bit>

namespace render::sampling {
namespace {

/// A bijection of 64 bits without visible structure [Stafford11, variant 13].
std::uint64_t mix(std::uint64_t v) {
  v ^= v >> 31;
  v *= 0x7fb5d329728ea185ull;
  v ^= v >> 27;
  v *= 0x81dadef4bc2dd44dull;
  return v ^ (v >> 33);
}

std::uint32_t reverse_bits(std::uint32_t v) {
  v = __builtin_bswap32(v);
  v = ((v & 0x0f0f0f0fu) << 4) | ((v >> 4) & 0x0f0f0f0fu);
  v = ((v & 0x33333333u) << 2) | ((v >> 2) & 0x33333333u);
  return ((v & 0x55555555u) << 1) | ((v >> 1) & 0x55555555u);
}

/// Owen scrambling of a bit-reversed fraction: a hash in which each bit depends on lower bits only [Burley20, Vegdahl21].
std::uint32_t owen(std::uint32_t v, std::uint32_t seed) {
  v ^= v * 0x3d20adeau;
  v += seed;
  v *= (seed >> 16) | 1;
  v ^= v * 0x05526c56u;
  v ^= v * 0x53a22864u;
  return v;
}

/// Columns of the second Sobol matrix, bit-reversed: Pascal's triangle modulo 2.
constexpr std::array<std::uint32_t, 64> kPascal = [] {
  std::array<std::uint32_t, 64> columns{};
  columns[0] = 1;
  for (std::size_t i = 1; i < 64; ++i) columns[i] = columns[i - 1] ^ (columns[i - 1] << 1);
  return columns;
}();

std::uint32_t sobol1(std::uint64_t index) {
  std::uint32_t sum = 0;
  for (; index; index &= index - 1) sum ^= kPascal[static_cast<std::size_t>(std::countr_zero(index))];
  return sum;
}

/// The 24 orders of four digits, two bits each.
constexpr std::array<std::uint8_t, 24> kOrders = [] {
  std::array<std::uint8_t, 24> orders{};
  std::size_t n = 0;
  for (unsigned a = 0; a < 4; ++a)
    for (unsigned b = 0; b < 4; ++b)
      for (unsigned c = 0; c < 4; ++c)
        if (a != b && a != c && b != c) orders[n++] = static_cast<std::uint8_t>(a | b << 2 | c << 4 | (6 - a - b - c) << 6);
  return orders;
}();

/// The digit at bit `shift` of `index` (base 4) in an order drawn from the digits above it [Ahmed20].
std::uint64_t shuffled_digit(std::uint64_t index, int shift, std::uint64_t salt) {
  const std::uint64_t above = shift + 2 < 64 ? index >> (shift + 2) : 0;
  const std::uint64_t order = ((mix(above ^ salt) >> 24) & 0xffffff) * 24 >> 24;
  return (kOrders[order] >> (2 * ((index >> shift) & 3))) & 3;
}

std::uint64_t spread_bits(std::uint64_t v) {
  v &= 0xffffffffull;
  v = (v ^ (v << 16)) & 0x0000ffff0000ffffull;
  v = (v ^ (v << 8)) & 0x00ff00ff00ff00ffull;
  v = (v ^ (v << 4)) & 0x0f0f0f0f0f0f0f0full;
  v = (v ^ (v << 2)) & 0x3333333333333333ull;
  return (v ^ (v << 1)) & 0x5555555555555555ull;
}

int bits_for(std::uint64_t count) { return count > 1 ? 64 - std::countl_zero(count - 1) : 0; }

std::uint64_t salt_of(std::uint32_t dimension, std::uint32_t seed) { return mix((std::uint64_t(seed) << 32) | dimension); }

float fraction(std::uint32_t bits) { return static_cast<float>(bits >> 8) * 0x1p-24f; }

}  // namespace

Sequence::Sequence(std::int64_t width, std::int64_t height, std::int64_t spp, std::int64_t frame)
    : sample_bits(bits_for(static_cast<std::uint64_t>(spp))), seed(static_cast<std::uint32_t>(mix(static_cast<std::uint64_t>(frame)) >> 32)) {
  const int pixel_bits = bits_for(static_cast<std::uint64_t>(width > height ? width : height));
  digits = pixel_bits + (sample_bits + 1) / 2;
}

PixelSampler::PixelSampler(const Sequence& sequence, std::uint32_t x, std::uint32_t y)
    : sequence_(sequence), pixel_(spread_bits(x) | (spread_bits(y) << 1)) {}

PixelSampler::Prefix PixelSampler::prefix(std::uint32_t dimension) const {
  const std::uint64_t salt = salt_of(dimension, sequence_.seed), index = pixel_ << sequence_.sample_bits;
  const int odd = sequence_.sample_bits & 1;
  std::uint64_t shuffled = 0;
  for (int digit = sequence_.digits - 1; 2 * digit - odd >= sequence_.sample_bits; --digit)
    shuffled |= shuffled_digit(index, 2 * digit - odd, salt) << (2 * digit - odd);
  const std::uint64_t scramble = mix(salt + 0x9e3779b97f4a7c15ull);
  return {salt, static_cast<std::uint32_t>(shuffled), sobol1(shuffled), static_cast<std::uint32_t>(scramble), static_cast<std::uint32_t>(scramble >> 32)};
}

Point PixelSampler::point(std::uint32_t sample, std::uint32_t dimension) {
  Prefix shared;
  if (dimension < kCached) {
    if (!(cached_ >> dimension & 1)) {
      prefixes_[dimension] = prefix(dimension);
      cached_ |= 1u << dimension;
    }
    shared = prefixes_[dimension];
  } else {
    shared = prefix(dimension);
  }
  const std::uint64_t salt = shared.salt, index = (pixel_ << sequence_.sample_bits) | sample;
  std::uint64_t low = 0;
  int shift = sequence_.sample_bits;
  while (shift >= 2) {
    shift -= 2;
    low |= shuffled_digit(index, shift, salt) << shift;
  }
  if (shift == 1) low |= (index & 1) ^ (mix((index >> 1) ^ salt) & 1);  // an odd number of bits leaves half a digit
  return {fraction(reverse_bits(owen(shared.sobol0 ^ static_cast<std::uint32_t>(low), shared.scramble0))),
          fraction(reverse_bits(owen(shared.sobol1 ^ sobol1(low), shared.scramble1)))};
}

}  // namespace render::sampling
