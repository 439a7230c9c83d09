#include "render/sampling/sampler.h"

#include <bit>

namespace render::sampling {
namespace {

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

/// Sobol's second dimension, bit-reversed as the first one is: Pascal's triangle modulo 2, a Kronecker power of [1 1; 0 1].
std::uint32_t pascal(std::uint32_t index) {
  index ^= (index >> 1) & 0x55555555u;
  index ^= (index >> 2) & 0x33333333u;
  index ^= (index >> 4) & 0x0f0f0f0fu;
  index ^= (index >> 8) & 0x00ff00ffu;
  return index ^ (index >> 16);
}

std::uint64_t spread_bits(std::uint64_t v) {
  v = (v ^ (v << 16)) & 0x0000ffff0000ffffull;
  v = (v ^ (v << 8)) & 0x00ff00ff00ff00ffull;
  v = (v ^ (v << 4)) & 0x0f0f0f0f0f0f0f0full;
  v = (v ^ (v << 2)) & 0x3333333333333333ull;
  return (v ^ (v << 1)) & 0x5555555555555555ull;
}

float fraction(std::uint32_t reversed) { return static_cast<float>(reverse_bits(reversed) >> 8) * 0x1p-24f; }

}  // namespace

std::uint64_t mix(std::uint64_t v) {
  v ^= v >> 31;
  v *= 0x7fb5d329728ea185ull;
  v ^= v >> 27;
  v *= 0x81dadef4bc2dd44dull;
  return v ^ (v >> 33);
}

Sequence::Sequence(std::int64_t spp, std::int64_t frame)
    : sample_bits(std::bit_width(static_cast<std::uint64_t>(spp - 1))), seed(mix(static_cast<std::uint64_t>(frame))) {}

// What of a sample's number does not fit into 32 bits (an image of more than 2^32 samples) goes into the seed.
PixelSampler::PixelSampler(const Sequence& sequence, std::uint32_t x, std::uint32_t y)
    : first_((spread_bits(x) | (spread_bits(y) << 1)) << sequence.sample_bits), seed_(sequence.seed ^ (first_ >> 32)) {}

Point PixelSampler::point(std::uint32_t sample, std::uint32_t dimension) const {
  const std::uint64_t seed = mix(seed_ + dimension * 0x9e3779b97f4a7c15ull), other = seed * 0xd6e8feb86659fd93ull;
  const std::uint32_t number = static_cast<std::uint32_t>(first_) | sample;
  const std::uint32_t index = reverse_bits(owen(reverse_bits(number), static_cast<std::uint32_t>(seed)));
  return {fraction(owen(index, static_cast<std::uint32_t>(seed >> 32))), fraction(owen(pascal(index), static_cast<std::uint32_t>(other >> 32)))};
}

}  // namespace render::sampling
