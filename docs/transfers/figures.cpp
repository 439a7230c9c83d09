// The data of the figures in docs/transfers.md, from the transfers themselves. Prints blocks that gnuplot's `index` tells apart.
#include <cmath>
#include <cstdio>
#include <iterator>
#include <random>
#include <string>

#include "sim/transfer/mac_transfer.h"

namespace {

using namespace sim;

constexpr int kCells = 64;

struct Scheme {
  const char* name;
  Transfer transfer;
  Kernel kernel;
  std::int64_t modes;   // 0: the scheme's own
};
constexpr Scheme kSchemes[] = {{"PIC", Transfer::pic, Kernel::quadratic, 0},          {"APIC", Transfer::apic, Kernel::quadratic, 0},
                               {"PolyPIC 4", Transfer::polypic, Kernel::quadratic, 4}, {"PolyPIC 6", Transfer::polypic, Kernel::quadratic, 6},
                               {"PolyPIC 9", Transfer::polypic, Kernel::quadratic, 9}, {"linear APIC", Transfer::apic, Kernel::linear, 0},
                               {"linear PolyPIC 4", Transfer::polypic, Kernel::linear, 4}};

const ActiveBlocks<2> kBlocks = ActiveBlocks<2>::whole(Lattice<2>({kCells, kCells}, {true, true}));

/// Two by two particles a cell, each somewhere in its quarter.
Particles<2, double> stratified(int modes) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> uniform(0, 1);
  Particles<2, double> particles;
  particles.modes = modes;
  particles.mass = 1;
  particles.resize(4 * kCells * kCells);
  for (std::size_t p = 0; p < particles.size(); ++p) {
    const int cell = int(p / 4), quarter = int(p % 4);
    particles.id[p] = std::int64_t(p);
    particles.cell[p] = {cell / kCells, cell % kCells};
    particles.offset[p] = {0.5 * (quarter / 2 + uniform(random)), 0.5 * (quarter % 2 + uniform(random))};
  }
  return particles;
}

template <class Value>
FaceField<2, double> field_of(const Value& value) {
  FaceField<2, double> field;
  for (std::size_t c = 0; c < 2; ++c) {
    field[c].resize(kBlocks.size());
    for (std::size_t i = 0; i < kBlocks.size(); ++i) field[c][i] = value(c, kBlocks.cell_at(i));
  }
  return field;
}

/// Square vortices `wavelength` cells wide.
FaceField<2, double> vortices(double wavelength) {
  const double k = 2 * M_PI / wavelength;
  return field_of([&](std::size_t c, const Cell<2>& at) {
    return c == 0 ? std::sin(k * at[0]) * std::cos(k * (at[1] + 0.5)) : -std::cos(k * (at[0] + 0.5)) * std::sin(k * at[1]);
  });
}

double energy(const FaceField<2, double>& field) {
  double sum = 0;
  for (const auto& component : field)
    for (const double v : component) sum += v * v;
  return sum;
}

/// Grid -> particles -> grid, nothing else.
class RoundTrip {
 public:
  explicit RoundTrip(const Scheme& scheme)
      : transfer_(scheme.kernel, mode_set<2>(scheme.transfer, scheme.kernel, {.count = scheme.modes, .name = {}})),
        particles_(stratified(int(transfer_.modes().size()))), ranges_(CanonicalOrder<2, double>().sort(particles_, kBlocks.lattice())) {}
  FaceField<2, double> operator()(const FaceField<2, double>& field) {
    transfer_.gather(kBlocks, field, nullptr, {}, particles_);
    MacVelocity<2, double> grid;
    transfer_.scatter(particles_, ranges_, kBlocks, grid);
    return grid.velocity;
  }

 private:
  MacTransfer<2, double> transfer_;
  Particles<2, double> particles_;
  CellRanges ranges_;
};

void print_names(const char* first) {
  std::printf("\"%s\"", first);
  for (const Scheme& scheme : kSchemes) std::printf(" \"%s\"", scheme.name);
  std::printf("\n");
}

/// A row of random velocities, and what comes back.
void print_row() {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> uniform(-1, 1);
  std::vector<double> values(2 * kCells * kCells);
  for (double& v : values) v = uniform(random);
  const FaceField<2, double> field = field_of([&](std::size_t c, const Cell<2>& at) { return values[(c * kCells + std::size_t(at[1])) * kCells + std::size_t(at[0])]; });
  std::vector<FaceField<2, double>> after;
  for (const Scheme& scheme : kSchemes) after.push_back(RoundTrip(scheme)(field));
  print_names("grid");
  for (int i = 0; i <= 16; ++i) {
    const auto place = std::size_t(kBlocks.index({i + 10, 20}));
    std::printf("%.6f", field[0][place]);
    for (const auto& f : after) std::printf(" %.6f", f[0][place]);
    std::printf("\n");
  }
}

/// Energy kept in one round trip by vortices of each wavelength.
void print_spectrum() {
  print_names("cells a wavelength");
  for (const int waves : {1, 2, 3, 4, 5, 6, 7, 8, 10, 12, 14, 16, 18, 20, 22, 24, 26, 28, 30}) {
    const double wavelength = double(kCells) / waves;
    const FaceField<2, double> start = vortices(wavelength);
    std::printf("%.4f", wavelength);
    for (const Scheme& scheme : kSchemes) std::printf(" %.8f", energy(RoundTrip(scheme)(start)) / energy(start));
    std::printf("\n");
  }
}

/// Energy kept by vortices of eight cells in many round trips.
void print_decay() {
  const FaceField<2, double> start = vortices(8);
  std::vector<std::vector<double>> kept;
  for (const Scheme& scheme : kSchemes) {
    RoundTrip trip(scheme);
    FaceField<2, double> field = start;
    kept.push_back({1});
    for (int n = 1; n <= 100; ++n) {
      field = trip(field);
      kept.back().push_back(energy(field) / energy(start));
    }
  }
  print_names("round trips");
  for (std::size_t n = 0; n <= 100; ++n) {
    std::printf("%zu", n);
    for (const auto& k : kept) std::printf(" %.8f", k[n]);
    std::printf("\n");
  }
}

}  // namespace

int main() {
  print_row();
  std::printf("\n\n");
  print_spectrum();
  std::printf("\n\n");
  print_decay();
}
