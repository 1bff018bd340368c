// SPDX-License-Identifier: Apache-2.0
#include "clients/softbody/fem/kernel.h"

#include <algorithm>
#include <stdexcept>

#include "clients/softbody/fem/laws.h"

// The ABI for vectors depends on the processor, but all functions that take them are inlined.
#pragma GCC diagnostic ignored "-Wpsabi"

namespace tendon::softbody {
namespace {

using kernel::lanes_at;

constexpr int kLanesAtOnce = static_cast<int>(kLanes);

struct View {
  int points;
  int elements;
  const int* nodes;
  const double* gradients;
  const double* moduli;
};

template <Law kLaw, int kNodes>
[[gnu::always_inline]] inline double sum_of(const View& all, const double* u, double* to) {
  Lanes energy{};
  const int* nodes = all.nodes;
  const double* gradient = all.gradients;
  const double* modulus = all.moduli;
  for (int first = 0; first < all.elements; first += kLanesAtOnce) {
    const int full = std::min(kLanesAtOnce, all.elements - first);
    Lanes local[3 * kNodes] = {};
    Lanes force[3 * kNodes] = {};
    for (int k = 0; k < full; ++k) {
      for (int i = 0; i < kNodes; ++i) {
        const double* node = u + 3 * static_cast<std::ptrdiff_t>(nodes[k * kNodes + i]);
        for (int c = 0; c < 3; ++c) local[3 * i + c][k] = node[c];
      }
    }
    for (int q = 0; q < all.points; ++q) {
      Lanes f[9] = {};
      for (int i = 0; i < 9; i += 4) f[i] += 1.0;
      for (int i = 0; i < kNodes; ++i) {
#pragma GCC unroll 3
        for (int c = 0; c < 3; ++c) {
          const Lanes g = lanes_at(gradient + (3 * i + c) * kLanesAtOnce);
#pragma GCC unroll 3
          for (int r = 0; r < 3; ++r) f[r + 3 * c] += local[3 * i + r] * g;
        }
      }
      Lanes p[9];
      kernel::respond<kLaw, Lanes>(f, lanes_at(modulus), lanes_at(modulus + kLanesAtOnce), energy, p);
      for (int i = 0; i < kNodes; ++i) {
        const double* g = gradient + 3 * i * kLanesAtOnce;
#pragma GCC unroll 3
        for (int r = 0; r < 3; ++r) {
          force[3 * i + r] +=
              p[r] * lanes_at(g) + p[r + 3] * lanes_at(g + kLanesAtOnce) + p[r + 6] * lanes_at(g + 2 * kLanesAtOnce);
        }
      }
      gradient += 3 * kNodes * kLanesAtOnce;
      modulus += 2 * kLanesAtOnce;
    }
    for (int k = 0; k < full; ++k) {
      for (int i = 0; i < kNodes; ++i) {
        double* node = to + 3 * static_cast<std::ptrdiff_t>(nodes[k * kNodes + i]);
        for (int c = 0; c < 3; ++c) node[c] += force[3 * i + c][k];
      }
    }
    nodes += full * kNodes;
  }
  return energy[0] + energy[1] + energy[2] + energy[3];
}

// Compiled twice. The results are the same, because neither version uses FMA.
#ifdef __x86_64__
template <Law kLaw, int kNodes>
[[gnu::target("avx2")]] double wide_sum_of(const View& all, const double* u, double* to) {
  return sum_of<kLaw, kNodes>(all, u, to);
}
bool wide() {
  static const bool has = __builtin_cpu_supports("avx2") != 0;
  return has;
}
#endif

}  // namespace

Kernel::Kernel(Law law, int nodes, int points) : law_(law), per_element_(nodes), points_(points) {
  if (nodes != 4 && nodes != 8 && nodes != 20 && nodes != 27)
    throw std::invalid_argument("no element type has this number of nodes");
}

void Kernel::add_element(std::span<const int> nodes) {
  nodes_.insert(nodes_.end(), nodes.begin(), nodes.end());
  const int groups = (++elements_ + kLanesAtOnce - 1) / kLanesAtOnce * points_;
  gradients_.resize(at(groups * 3 * per_element_) * kLanes);
  moduli_.resize(at(groups) * 2 * kLanes);
}

void Kernel::set_point(int element, int point, const Nodal& gradient, double mu, double lambda) {
  const std::size_t lane = at(element % kLanesAtOnce);
  const std::size_t first = group(element, point);
  const auto numbers = static_cast<std::size_t>(gradient.size());
  for (std::size_t i = 0; i < numbers; ++i) gradients_[(first * numbers + i) * kLanes + lane] = gradient.data()[i];
  moduli_[first * 2 * kLanes + lane] = mu;
  moduli_[(first * 2 + 1) * kLanes + lane] = lambda;
}

Kernel::Gradient Kernel::gradient(int element, int point) const {
  return {gradients_.data() + group(element, point) * at(3 * per_element_) * kLanes + at(element % kLanesAtOnce), 3,
          per_element_};
}

template <Law kLaw, int kNodes>
double Kernel::sum(const double* u, double* force) const {
  const View all{points_, elements_, nodes_.data(), gradients_.data(), moduli_.data()};
#ifdef __x86_64__
  if (wide()) return wide_sum_of<kLaw, kNodes>(all, u, force);
#endif
  return sum_of<kLaw, kNodes>(all, u, force);
}

template <Law kLaw>
double Kernel::sum(const double* u, double* force) const {
  switch (per_element_) {
    case 4:
      return sum<kLaw, 4>(u, force);
    case 8:
      return sum<kLaw, 8>(u, force);
    case 20:
      return sum<kLaw, 20>(u, force);
    default:
      return sum<kLaw, 27>(u, force);
  }
}

double Kernel::add_forces(const VectorXd& u, VectorXd& force) const {
  switch (law_) {
    case Law::kLinear:
      return sum<Law::kLinear>(u.data(), force.data());
    case Law::kCorotational:
      return sum<Law::kCorotational>(u.data(), force.data());
    case Law::kStVenantKirchhoff:
      return sum<Law::kStVenantKirchhoff>(u.data(), force.data());
    case Law::kNeoHookean:
      break;
  }
  return sum<Law::kNeoHookean>(u.data(), force.data());
}

std::size_t Kernel::bytes() const noexcept {
  return nodes_.size() * sizeof(int) + (gradients_.size() + moduli_.size()) * sizeof(double);
}

}  // namespace tendon::softbody
