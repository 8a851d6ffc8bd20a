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
  double farthest(int k) const { return std::max(std::abs(low[k]), std::abs(high[k])); }
};

// Smallest and largest magnitude of the rotation vectors of a box.
struct AngleRange {
  double least = 0, most = 0;

  AngleRange(const Box& box, int rotations) {
    for (int k = 3; k < 3 + rotations; ++k) {
      const double inner = std::max({0.0, box.low[k], -box.high[k]});
      least = std::hypot(least, inner), most = std::hypot(most, box.farthest(k));
    }
  }
  bool has_half_turns() const { return least <= kPi && kPi <= most; }
};

// Whether two boxes share an orientation at which their rotation vectors are opposite, of length pi. Rotation vectors
// that turn an axis (two components) of that length are one orientation; their cells touch along the circle.
bool share_half_turns(const Box& a, const Box& b, int rotations) {
  if (rotations < 3 || !AngleRange(a, rotations).has_half_turns() || !AngleRange(b, rotations).has_half_turns())
    return false;
  for (int k = 0; k < 3; ++k) {
    if (a.high[k] < b.low[k] || b.high[k] < a.low[k]) return false;
  }
  Box common;
  for (int k = 3; k < kDims; ++k) {
    common.low[k] = std::max(-a.high[k], b.low[k]), common.high[k] = std::min(-a.low[k], b.high[k]);
    if (common.low[k] > common.high[k]) return false;
  }
  return AngleRange(common, rotations).has_half_turns();
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
  double displacement;  // bound for the points of the body in all motions from the middle [m]
  Label label;
  std::vector<int> neighbours;  // cells that are neither divided nor blocked
};

class CageCells {
 public:
  CageCells(CagePoses& poses, long max_cells, CageAnswer& answer);
  bool decide();

 private:
  // Per cell: least cost of a path from some cells to it, its own cost included; kFar: there is none.
  using Costs = std::vector<std::int64_t>;
  static constexpr std::int64_t kFar = std::numeric_limits<std::int64_t>::max();
  static constexpr std::int64_t kTooSmall = std::int64_t{1} << 32;

  Cell make_cell(const Box& box);
  Label label_of(const Box& box, double displacement);
  CageMotion motion_in(const Box& box) const;
  Posed pose_in(const Box& box) const;
  int longest(const Box& box) const;
  bool at_exit(const Box& box) const;
  bool are_neighbours(const Box& a, const Box& b) const {
    return share_face(a, b, dims_) || share_half_turns(a, b, rotations_);
  }
  void divide(int cell);
  void connect(int cell, const std::vector<int>& candidates);
  bool contains_present(const Box& box) const;
  int start() const;
  std::int64_t cost_of(const Cell& cell) const;
  Costs costs_from(const std::vector<int>& sources) const;
  bool is_out_of_cells() { return answer_.out_of_cells = answer_.cells >= max_cells_; }

  CagePoses& poses_;
  const long max_cells_;
  const int rotations_, dims_;
  std::vector<Cell> cells_;
  CageAnswer& answer_;
};

// One cell of all poses. The present pose is at a third of it in each dimension, so that halving never puts it on a
// face.
CageCells::CageCells(CagePoses& poses, long max_cells, CageAnswer& answer)
    : poses_(poses), max_cells_(max_cells), rotations_(poses.rotations().dims), dims_(3 + rotations_), answer_(answer) {
  Box all;
  for (int k = 0; k < dims_; ++k) {
    const double size = k < 3 ? poses.leave() : kPi;
    all.low[k] = -size, all.high[k] = 2 * size;
  }
  cells_.push_back(make_cell(all));
}

Posed CageCells::pose_in(const Box& box) const {
  Vector3d turn = Vector3d::zero();
  for (int k = 3; k < dims_; ++k) turn = turn + box.middle(k) * poses_.rotations().axes[k - 3];
  const double angle = norm(turn);
  const Rotationd rotation = angle > 0 ? rotation_about((1 / angle) * turn, angle) : Rotationd::identity();
  return poses_.pose({box.middle(0), box.middle(1), box.middle(2)}, rotation);
}

// The dimension along which the body's points move most.
int CageCells::longest(const Box& box) const {
  int best = 0;
  double most = -1;
  for (int k = 0; k < dims_; ++k) {
    const double moves = (k < 3 ? 1 : poses_.body().radius) * box.half(k);
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

// Bounds of all motions from a cell's middle (24.1).
CageMotion CageCells::motion_in(const Box& box) const {
  double turn = 0;
  for (int k = 3; k < dims_; ++k) turn += box.half(k) * box.half(k);
  return {std::hypot(box.half(0), box.half(1), box.half(2)), std::sqrt(turn)};
}

// Cell => its label, by distances and overlaps at its middle (24.2). Rotation vectors beyond pi are not needed.
Label CageCells::label_of(const Box& box, double displacement) {
  if (AngleRange(box, rotations_).least > kPi) return Label::blocked;
  ++answer_.cells;
  const Posed X_FM = pose_in(box);
  if (poses_.stays_overlapping(X_FM, motion_in(box))) return Label::blocked;
  const double distance = poses_.distance(X_FM, displacement);
  if (distance < -displacement) return Label::blocked;
  return distance > displacement ? Label::free : Label::mixed;
}

Cell CageCells::make_cell(const Box& box) {
  const CageMotion motion = motion_in(box);
  const double displacement = motion.translation + poses_.body().radius * motion.angle;
  return {box, displacement, label_of(box, displacement), {}};
}

// A mixed cell => two labelled halves with their neighbours.
void CageCells::divide(int cell) {
  const Box box = cells_[cell].box;
  const int dim = longest(box);
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
    if (!are_neighbours(cells_[cell].box, cells_[other].box)) continue;
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

// Cells => whether they show the answer; otherwise divides all mixed cells on the cheapest paths from the present pose
// to the exit.
bool CageCells::decide() {
  using Verdict = CageAnswer::Verdict;
  const Costs here = costs_from({start()});
  std::vector<int> exits;
  std::int64_t cheapest = kFar;
  const int count = static_cast<int>(cells_.size());
  for (int i = 0; i < count; ++i) {
    if (here[i] == kFar || !at_exit(cells_[i].box)) continue;
    exits.push_back(i);
    cheapest = std::min(cheapest, here[i]);
  }
  if (cheapest == kFar) answer_.verdict = Verdict::caged;
  if (cheapest == 0) answer_.verdict = Verdict::can_leave;
  if (cheapest == kFar || cheapest == 0 || cheapest >= kTooSmall) return true;
  const Costs there = costs_from(exits);
  for (int i = 0; i < count; ++i) {
    if (cells_[i].label != Label::mixed || here[i] == kFar || here[i] + there[i] - 1 > cheapest) continue;
    if (is_out_of_cells()) return true;
    divide(i);
  }
  return false;
}

}  // namespace

void prove_caged(CagePoses& poses, long max_cells, CageAnswer& answer) {
  CageCells cells(poses, max_cells, answer);
  while (!cells.decide()) {
  }
}

}  // namespace grapnel
