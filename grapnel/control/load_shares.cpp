#include "grapnel/control/load_shares.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace grapnel {
namespace {

// The square of a load's share, a + 2 b k + c k^2.
struct Square {
  double a, b, c;
};

Square square_of(const LimitedLoad& load) {
  const double scale = 1 / (load.limit * load.limit);
  return {scale * load.fixed.squaredNorm(), scale * load.fixed.dot(load.varied), scale * load.varied.squaredNorm()};
}

// Real zeros of a + 2 b k + c k^2.
int zeros(const Square& s, std::array<double, 2>& at) {
  if (s.c == 0) {
    if (s.b == 0) return 0;
    at[0] = -0.5 * s.a / s.b;
    return 1;
  }
  const double root = s.b * s.b - s.a * s.c;
  if (!(root >= 0)) return 0;
  const double q = -(s.b + std::copysign(std::sqrt(root), s.b));
  at[0] = q / s.c;
  if (q == 0) return 1;
  at[1] = s.a / q;
  return 2;
}

// The largest share is a convex function of k: its minimum is at an end, at a load's own minimum, or where two are
// equal.
LoadShare least_largest_share(const std::vector<LimitedLoad>& loads, double most) {
  LoadShare best = share_at(loads, 0);
  const auto consider = [&](double k) {
    if (!(k > 0 && k <= most)) return;
    const LoadShare at = share_at(loads, k);
    if (at.share < best.share) best = at;
  };
  consider(most);
  std::vector<Square> squares;
  for (const LimitedLoad& load : loads) squares.push_back(square_of(load));
  std::array<double, 2> at{};
  for (std::size_t i = 0; i < squares.size(); ++i) {
    const Square& s = squares[i];
    if (s.c > 0) consider(-s.b / s.c);
    for (std::size_t j = i + 1; j < squares.size(); ++j) {
      const int n = zeros({s.a - squares[j].a, s.b - squares[j].b, s.c - squares[j].c}, at);
      for (int z = 0; z < n; ++z) consider(at[z]);
    }
  }
  return best;
}

}  // namespace

LoadShare share_at(const std::vector<LimitedLoad>& loads, double k) {
  LoadShare result{k, 0, -1};
  for (std::size_t i = 0; i < loads.size(); ++i) {
    const double share = (loads[i].fixed + k * loads[i].varied).norm() / loads[i].limit;
    if (result.load < 0 || share > result.share) result.share = share, result.load = static_cast<int>(i);
  }
  return result;
}

// Loads => largest k in [0, most] within all limits, from the roots of each load's quadratic inequality; if there is
// none, the k with the least largest share.
LoadShare largest_within(const std::vector<LimitedLoad>& loads, double most) {
  if (const LoadShare all = share_at(loads, most); all.share <= 1) return all;
  double low = 0, high = most;
  bool possible = true;
  std::array<double, 2> at{};
  for (const LimitedLoad& load : loads) {
    Square s = square_of(load);
    s.a -= 1;
    const int n = zeros(s, at);
    if (s.c == 0) {  // independent of k
      possible = possible && s.a <= 0;
      continue;
    }
    if (n == 0) possible = false;
    if (n == 1) at[1] = at[0];
    if (n == 0) continue;
    low = std::max(low, std::min(at[0], at[1])), high = std::min(high, std::max(at[0], at[1]));
  }
  if (!possible || low > high) return least_largest_share(loads, most);
  LoadShare result = share_at(loads, high);
  result.share = std::min(result.share, 1.0);  // removes rounding error
  return result;
}

}  // namespace grapnel
