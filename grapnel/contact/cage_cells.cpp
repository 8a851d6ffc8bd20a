#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <functional>
#include <limits>
#include <numbers>
#include <queue>
#include <stdexcept>

#include "grapnel/contact/cage_poses.hpp"

namespace grapnel {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr int kDims = 6;  // position, then rotation vector

// A box of positions of the centre, relative to the present one, and of rotation vectors.
struct Box {
  std::array<double, kDims> low{}, high{};

  double half(int k) const { return 0.5 * (high[k] - low[k]); }
  double middle(int k) const { return 0.5 * (high[k] + low[k]); }
};

// Angle between two orientations, accurate near zero.
double angle_between(const Quaterniond& a, const Quaterniond& b) {
  const auto distance = [&](double sign) {
    const double w = a.w - sign * b.w, x = a.x - sign * b.x, y = a.y - sign * b.y, z = a.z - sign * b.z;
    return std::sqrt(w * w + x * x + y * y + z * z);
  };
  return 4 * std::asin(std::min(1.0, 0.5 * std::min(distance(1), distance(-1))));
}

// Smallest magnitude of the rotation vectors of a box.
double least_angle(const Box& box, int rotations) {
  double least = 0;
  for (int k = 3; k < 3 + rotations; ++k) least = std::hypot(least, std::max({0.0, box.low[k], -box.high[k]}));
  return least;
}

// Whether two boxes without common interior share a part of a face.
bool share_face(const Box& a, const Box& b, int dims) {
  int touching = 0;
  for (int k = 0; k < dims; ++k) {
    if (a.high[k] < b.low[k] || b.high[k] < a.low[k]) return false;
    if (a.high[k] == b.low[k] || b.high[k] == a.low[k]) ++touching;
  }
  return touching == 1;
}

enum class Label : std::uint8_t {
  divided,  // into two children
  blocked,  // every pose overlaps
  free,     // no pose overlaps
  mixed,    // neither was shown
};

struct Cell {
  Box box;
  Quaterniond q;        // of its middle
  double angle;         // bound of the rotations from there [rad]
  double arm;           // CageOverlap
  double displacement;  // bound for the points of the shape of `arm` in all motions from the middle [m]
  Label label;
  bool wraps;                   // contains half turns, which opposite rotation vectors describe, too
  std::vector<int> neighbours;  // cells that are neither divided nor blocked
};

class CageCells {
 public:
  CageCells(CagePoses& poses, long max_cells, CageAnswer& answer, const CageTrial& trial);
  bool decide();

 private:
  // Per cell: least cost of a path from some cells to it, its own cost included; kFar: there is none.
  using Costs = std::vector<std::int64_t>;
  static constexpr std::int64_t kFar = std::numeric_limits<std::int64_t>::max();
  static constexpr std::int64_t kTooSmall = std::int64_t{1} << 32;

  Cell make_cell(const Box& box);
  Label label_of(Cell& cell);
  bool wraps(const Cell& cell) const;
  int longest(const Cell& cell) const;
  bool at_exit(const Box& box) const;
  bool are_neighbours(const Cell& a, const Cell& b) const;
  void divide(int cell);
  void connect(int cell, const std::vector<int>& candidates);
  bool contains_present(const Box& box) const;
  int start() const;
  std::int64_t cost_of(const Cell& cell) const;
  Costs costs_from(const std::vector<int>& sources) const;
  bool is_out_of_cells() { return answer_.out_of_cells = answer_.cells >= max_cells_; }

  std::vector<int> path_to(int exit, const Costs& here) const;
  bool leads_out(const std::vector<int>& path, bool all_free);

  CagePoses& poses_;
  const CageTrial& trial_;
  const long max_cells_;
  const int rotations_, dims_;
  std::vector<Cell> cells_;
  CageAnswer& answer_;
  long tried_ = 0;  // evaluated poses at the last trial of a path
};

// One cell of all poses. The present pose is at a third of it in each dimension, so that halving never puts it on a
// face.
CageCells::CageCells(CagePoses& poses, long max_cells, CageAnswer& answer, const CageTrial& trial)
    : poses_(poses),
      trial_(trial),
      max_cells_(max_cells),
      rotations_(poses.rotations().dims),
      dims_(3 + rotations_),
      answer_(answer) {
  Box all;
  for (int k = 0; k < dims_; ++k) {
    const double size = k < 3 ? poses.leave() : kPi;
    all.low[k] = -size, all.high[k] = 2 * size;
  }
  cells_.push_back(make_cell(all));
}

// The dimension along which the points of the shape that overlaps most move most.
int CageCells::longest(const Cell& cell) const {
  int best = 0;
  double most = -1;
  for (int k = 0; k < dims_; ++k) {
    const double moves = (k < 3 ? 1 : cell.arm) * cell.box.half(k);
    if (moves > most) most = moves, best = k;
  }
  return best;
}

bool CageCells::at_exit(const Box& box) const {
  for (int k = 0; k < 3; ++k) {
    if (box.low[k] <= -poses_.leave() || box.high[k] >= poses_.leave()) return true;
  }
  return false;
}

// Whether the cell may contain half turns, so that paths may continue at the opposite rotation vector. Paths of a body
// of revolution can avoid the orientation opposite to the present one.
bool CageCells::wraps(const Cell& cell) const {
  return rotations_ == 3 && angle_between(cell.q, Quaterniond::identity()) + cell.angle >= kPi;
}

// Cell => its label, by distances and overlaps at its middle (24.2).
Label CageCells::label_of(Cell& cell) {
  if (least_angle(cell.box, rotations_) > kPi) return Label::blocked;  // not needed
  ++answer_.cells;
  const Box& box = cell.box;
  const double translation = std::hypot(box.half(0), box.half(1), box.half(2));
  const Posed X_FM = poses_.pose({box.middle(0), box.middle(1), box.middle(2)}, rotation_matrix(cell.q));
  const CageOverlap overlap = poses_.overlap(X_FM, {translation, cell.angle});
  cell.arm = overlap.arm;
  cell.displacement = translation + cell.arm * cell.angle;
  if (overlap.kind == CageOverlap::Kind::blocked) return Label::blocked;
  return overlap.kind == CageOverlap::Kind::free ? Label::free : Label::mixed;
}

Cell CageCells::make_cell(const Box& box) {
  double turn = 0;
  for (int k = 3; k < dims_; ++k) turn += box.half(k) * box.half(k);
  Cell cell{box,
            poses_.rotations().rotation({box.middle(3), box.middle(4), box.middle(5)}),
            std::sqrt(turn),
            0,
            0,
            Label::blocked,
            false,
            {}};
  cell.label = label_of(cell);
  if (cell.label != Label::blocked) cell.wraps = wraps(cell);
  return cell;
}

// Cells that share a face, or may share orientations of different rotation vectors.
bool CageCells::are_neighbours(const Cell& a, const Cell& b) const {
  if (share_face(a.box, b.box, dims_)) return true;
  if (!a.wraps || !b.wraps) return false;
  for (int k = 0; k < 3; ++k) {
    if (a.box.high[k] <= b.box.low[k] || b.box.high[k] <= a.box.low[k]) return false;
  }
  return angle_between(a.q, b.q) <= a.angle + b.angle;
}

// A mixed cell => two labelled halves with their neighbours.
void CageCells::divide(int cell) {
  const Box box = cells_[cell].box;
  const int dim = longest(cells_[cell]);
  std::vector<int> candidates = std::move(cells_[cell].neighbours);
  cells_[cell].label = Label::divided, cells_[cell].neighbours.clear();
  for (const int neighbour : candidates) std::erase(cells_[neighbour].neighbours, cell);
  for (int half = 0; half < 2; ++half) {
    Box part = box;
    (half == 0 ? part.high : part.low)[dim] = box.middle(dim);
    Cell child = make_cell(part);
    if (child.label == Label::blocked) continue;
    cells_.push_back(std::move(child));
    const int index = static_cast<int>(cells_.size()) - 1;
    connect(index, candidates);
    candidates.push_back(index);
  }
}

void CageCells::connect(int cell, const std::vector<int>& candidates) {
  for (const int other : candidates) {
    if (!are_neighbours(cells_[cell], cells_[other])) continue;
    cells_[cell].neighbours.push_back(other);
    cells_[other].neighbours.push_back(cell);
  }
}

bool CageCells::contains_present(const Box& box) const {
  for (int k = 0; k < dims_; ++k) {
    if (box.low[k] > 0 || box.high[k] < 0) return false;
  }
  return true;
}

// The cell of the present pose. It is not blocked, because the allowance exceeds the present overlap.
int CageCells::start() const {
  int cell = static_cast<int>(cells_.size()) - 1;
  while (cells_[cell].label == Label::divided || !contains_present(cells_[cell].box)) --cell;
  return cell;
}

// Free cells cost nothing. One that cannot be divided costs more than any path through others.
std::int64_t CageCells::cost_of(const Cell& cell) const {
  if (cell.label == Label::free) return 0;
  return cell.displacement > poses_.resolution() ? 1 : kTooSmall;
}

// Dijkstra's algorithm.
CageCells::Costs CageCells::costs_from(const std::vector<int>& sources) const {
  Costs costs(cells_.size(), kFar);
  using Entry = std::pair<std::int64_t, int>;
  std::priority_queue<Entry, std::vector<Entry>, std::greater<>> queue;
  const auto offer = [&](int cell, std::int64_t cost) {
    if (cost >= costs[cell]) return;
    costs[cell] = cost;
    queue.emplace(cost, cell);
  };
  for (const int source : sources) offer(source, cost_of(cells_[source]));
  while (!queue.empty()) {
    const auto [cost, cell] = queue.top();
    queue.pop();
    if (cost > costs[cell]) continue;
    for (const int neighbour : cells_[cell].neighbours) offer(neighbour, cost + cost_of(cells_[neighbour]));
  }
  return costs;
}

// Cells of a cheapest path from the present pose to the exit; in the opposite direction.
std::vector<int> CageCells::path_to(int exit, const Costs& here) const {
  std::vector<int> path{exit};
  std::vector<bool> visited(cells_.size(), false);
  visited[exit] = true;
  const int first = start();
  while (path.back() != first) {
    const int at = path.back();
    const std::int64_t before = here[at] - cost_of(cells_[at]);
    const auto next =
        std::ranges::find_if(cells_[at].neighbours, [&](int i) { return !visited[i] && here[i] == before; });
    if (next == cells_[at].neighbours.end()) {
      path.pop_back();
      continue;
    }
    visited[*next] = true;
    path.push_back(*next);
  }
  return path;
}

// Whether the motion along a path of cells that leads out is free, because all cells are, and no step relies on a bound
// of the orientations that they may share; or because the trial of its poses succeeds.
bool CageCells::leads_out(const std::vector<int>& path, bool all_free) {
  const auto shares = [&](int a, int b) { return share_face(cells_[a].box, cells_[b].box, dims_); };
  if (all_free && std::ranges::adjacent_find(path, std::not_fn(shares)) == path.end()) return true;
  if (!trial_) return false;
  std::vector<CageWaypoint> points;
  for (auto cell = path.rbegin(); cell != path.rend(); ++cell) {
    const Box& box = cells_[*cell].box;
    points.push_back({{box.middle(0), box.middle(1), box.middle(2)}, cells_[*cell].q});
  }
  return trial_(points);
}

// Cells => whether they show the answer; otherwise divides mixed cells on the cheapest paths from the present pose to
// the exit.
bool CageCells::decide() {
  using Verdict = CageAnswer::Verdict;
  const Costs here = costs_from({start()});
  std::vector<int> exits;
  std::int64_t cheapest = kFar;
  int nearest = 0;
  const int count = static_cast<int>(cells_.size());
  for (int i = 0; i < count; ++i) {
    if (here[i] == kFar || !at_exit(cells_[i].box)) continue;
    exits.push_back(i);
    if (here[i] < cheapest) cheapest = here[i], nearest = i;
  }
  if (cheapest == kFar) return answer_.verdict = Verdict::caged, true;
  const bool last = cheapest == 0 || cheapest >= kTooSmall;
  if (last || answer_.cells > tried_ + tried_ / 10) {
    tried_ = answer_.cells;
    if (leads_out(path_to(nearest, here), cheapest == 0)) return answer_.verdict = Verdict::can_leave, true;
  }
  if (last) return true;
  const Costs there = costs_from(exits);
  for (int i = 0; i < count; ++i) {
    if (cells_[i].label != Label::mixed || here[i] == kFar || here[i] + there[i] - 1 > cheapest) continue;
    if (is_out_of_cells()) return true;
    divide(i);
  }
  return false;
}

}  // namespace

void prove_caged(CagePoses& poses, long max_cells, CageAnswer& answer, const CageTrial& trial) {
  CageCells cells(poses, max_cells, answer, trial);
  while (!cells.decide()) {
  }
}

}  // namespace grapnel
