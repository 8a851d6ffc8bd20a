#include "grapnel/dynamics/derivatives_structure.hpp"

#include <algorithm>

namespace grapnel {
namespace {

void append(const std::vector<std::vector<int>>& lists, std::vector<int>& begin, std::vector<int>& entries) {
  begin = {0};
  for (const std::vector<int>& list : lists) {
    entries.insert(entries.end(), list.begin(), list.end());
    begin.push_back(static_cast<int>(entries.size()));
  }
}

}  // namespace

std::vector<std::vector<int>> velocities_before(const Tree<double>& tree) {
  std::vector<std::vector<int>> on(static_cast<std::size_t>(tree.velocities));
  const bool dense = !tree.chains.empty();
  std::vector<int> last;  // velocity of each link or of its nearest ancestor with one
  for (const TreeLink<double>& link : tree.links) {
    int before = link.parent < 0 ? -1 : last[static_cast<std::size_t>(link.parent)];
    const int count = velocity_count(link.joint);
    for (int v = link.v; v < link.v + count; ++v) {
      std::vector<int>& list = on[static_cast<std::size_t>(v)];
      if (dense) before = v - 1;
      if (before >= 0) {
        list = on[static_cast<std::size_t>(before)];
        list.push_back(before);
      }
      before = v;
    }
    last.push_back(before);
  }
  return on;
}

DerivativesStructure::DerivativesStructure(const Tree<double>& tree) {
  const std::vector<std::vector<int>> before = velocities_before(tree);
  const auto n = before.size();
  std::vector<std::vector<int>> beyond(n);
  std::vector<std::vector<char>> related(n, std::vector<char>(n));
  for (std::size_t i = 0; i < n; ++i) {
    related[i][i] = 1;
    for (const int a : before[i]) {
      const auto j = static_cast<std::size_t>(a);
      beyond[j].push_back(static_cast<int>(i));
      related[i][j] = related[j][i] = 1;
    }
  }
  append(before, before_begin_, before_);
  append(beyond, beyond_begin_, beyond_);

  // The columns of positions and velocities, one block after the other.
  std::vector<std::vector<int>> groups;
  for (std::size_t first = 0; first < 2 * n; first += kDerivativeColumns) {
    std::vector<int>& rows = groups.emplace_back();
    for (std::size_t i = n; i-- > 0;) {
      bool reached = false;
      for (std::size_t c = first; c < std::min(first + kDerivativeColumns, 2 * n); ++c)
        reached = reached || related[i][c % n];
      if (reached && !beyond[i].empty()) rows.push_back(static_cast<int>(i));
    }
  }
  append(groups, group_begin_, group_);
}

}  // namespace grapnel
