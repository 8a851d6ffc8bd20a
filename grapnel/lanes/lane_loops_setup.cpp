#include "grapnel/lanes/lane_loops_setup.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

#include "grapnel/constraint/loop_columns.hpp"

namespace grapnel::lanes {
namespace {

void put(const Posed& X, double* out) {
  std::copy(X.p.e, X.p.e + 3, out);
  for (int k = 0; k < 3; ++k) std::copy(X.R.m[k], X.R.m[k] + 3, out + 3 + 3 * k);
}

// Axes closer to parallel than this leave rows of W of its square, far below the pivot tolerance.
constexpr double kParallel = 1e-14;

// Plane of the relative motion of C and D.
struct Plane {
  Vector3d normal_C;
  bool slides_across;  // a joint slides along the normal
};

// Plane of a loop whose revolute joints all have parallel axes; nullopt: they are not parallel, or there are none.
// Rotating these joints changes neither the direction of their axes nor the out-of-plane component of a prismatic
// joint, so any posture may be used.
std::optional<Plane> plane_of(const Tree<double>& tree, const LoopPath& path) {
  std::vector<Vector3d> turning, sliding;  // in C
  bool single = true;
  const auto add = [&](const TreeLink<double>& link, const Rotationd& R_CL) {
    single = single && has_one_axis(link.joint);
    if (single) (turns_about_axis(link.joint) ? turning : sliding).push_back(R_CL.column(link.axis));
  };
  Rotationd R_CL = transpose(path.X_aC.R);
  for (int l : path.from_a) {
    const TreeLink<double>& link = tree.links[l];
    add(link, R_CL);
    R_CL = R_CL * transpose(link.X_PF.R);
  }
  for (std::size_t n = path.from_b.size(); n-- > 0;) {
    const TreeLink<double>& link = tree.links[path.from_b[n]];
    R_CL = R_CL * link.X_PF.R;
    add(link, R_CL);
  }
  if (!single || turning.empty()) return std::nullopt;
  Plane plane{turning.front(), false};
  for (const Vector3d& axis : turning) {
    if (norm(cross(axis, plane.normal_C)) > kParallel) return std::nullopt;
  }
  for (const Vector3d& axis : sliding) {
    if (std::abs(dot(axis, plane.normal_C)) > kParallel) plane.slides_across = true;
  }
  return plane;
}

// A rotation whose z axis is n.
Rotationd axes_about(const Vector3d& n) {
  int least = 0;
  for (int k = 1; k < 3; ++k) {
    if (std::abs(n[k]) < std::abs(n[least])) least = k;
  }
  Vector3d e = Vector3d::zero();
  e[least] = 1;
  const Vector3d across = cross(e, n), x = (1 / norm(across)) * across, y = cross(n, x);
  Rotationd R;
  for (int k = 0; k < 3; ++k) R.m[k][0] = x[k], R.m[k][1] = y[k], R.m[k][2] = n[k];
  return R;
}

// A closure in the format of the lanes: its path, with C and D rotated such that the directions of rows are axes of C,
// and the number of rows.
struct LaneRows {
  LoopPath path;
  LoopTable table;
};

// Directions in which no joint of the loop can move C relative to D get no rows: theirs in W are zero, and the relative
// acceleration has no component there. In a planar loop C rotates about its normal n alone, and without a prismatic
// joint across the plane there is no motion along n. A hinge h constrains the part of n normal to h.
LaneRows lane_rows(const Model& model, const LoopClosure& closure) {
  LaneRows rows;
  LoopPath& path = rows.path;
  path = make_loop_path(model, closure);
  rows.table = {path.link_a, path.link_b, path.angular_count, path.angular_count, 3};
  const std::optional<Plane> plane = plane_of(model.tree(), path);
  if (!plane) return rows;
  const Rotationd R = axes_about(plane->normal_C);
  path.X_aC.R = path.X_aC.R * R, path.X_bD.R = path.X_bD.R * R;
  path.hinge_C = transpose(R) * path.hinge_C;
  rows.table.push_rows = plane->slides_across ? 3 : 2;
  Vector3d about{0, 0, 1};
  if (path.angular_count == 2) about -= dot(about, path.hinge_C) * path.hinge_C;
  rows.table.turn_rows = path.angular_count > 0 && norm(about) > kParallel ? 1 : 0;
  path.angular_rows[0] = rows.table.turn_rows > 0 ? (1 / norm(about)) * about : Vector3d::zero();
  path.angular_rows[1] = path.angular_rows[2] = Vector3d::zero();
  return rows;
}

}  // namespace

// Closures of a phase => reason why lanes cannot integrate them; empty if they can: one tree on a floating base, closed
// by projection (8.9), (8.10).
std::string loop_obstacle(const Model& model, const PhaseSetup& setup) {
  if (setup.closures.empty()) return {};
  // Projection changes the coordinates of all roots; a fixed root has none.
  for (const TreeLink<double>& link : model.tree().links) {
    if (link.joint == JointType::fixed) return "closed loops on a fixed or held base";
  }
  if (!setup.project_loops || setup.loop_feedback != 0) return "loops are not closed by projection";
  for (const LoopClosure& closure : setup.closures) {
    const LoopPath path = make_loop_path(model, closure);
    if (!path.one_tree()) return "closures connect two trees";
    const int root = model.bodies()[closure.body_a].root;
    if (root == setup.held_root) return "closed loops on a fixed or held base";
  }
  return {};
}

std::vector<LoopTable> loop_tables(const Model& model, const PhaseSetup& setup) {
  std::vector<LoopTable> tables;
  for (const LoopClosure& closure : setup.closures) {
    tables.push_back(lane_rows(model, closure).table);
  }
  return tables;
}

// Closures => kLoopNumbers each: poses of C and D in their links, hinge, rows of rotation and scales of the rows.
std::vector<double> loop_numbers(const Model& model, const PhaseSetup& setup) {
  std::vector<double> numbers(setup.closures.size() * kLoopNumbers);
  double* out = numbers.data();
  for (const LoopClosure& closure : setup.closures) {
    const LaneRows rows = lane_rows(model, closure);
    const LoopPath& path = rows.path;
    put(path.X_aC, out + kLoopAC);
    put(path.X_bD, out + kLoopBD);
    std::copy(path.hinge_C.e, path.hinge_C.e + 3, out + kLoopHinge);
    for (int r = 0; r < rows.table.turn_rows; ++r)
      std::copy(path.angular_rows[r].e, path.angular_rows[r].e + 3, out + kLoopTurns + 3 * r);
    out[kLoopAngularScale] = path.angular_scale;
    out[kLoopLinearScale] = path.linear_scale;
    out += kLoopNumbers;
  }
  return numbers;
}

}  // namespace grapnel::lanes
