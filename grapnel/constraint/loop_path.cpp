#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>

#include "grapnel/constraint/loop_columns.hpp"
#include "grapnel/dynamics/recursion.hpp"
#include "grapnel/model/coupling.hpp"

namespace grapnel {
namespace {

std::vector<int> links_to_root(const Tree<double>& tree, int link) {
  std::vector<int> links;
  for (int l = link; l >= 0; l = tree.links[l].parent) links.push_back(l);
  return links;
}

// From X_KP to X_KL: one step outward from a parent P. Rotating columns is cheaper than a matrix product.
GRAPNEL_INLINE void step_outward(const TreeLink<double>& link, const LinkScratch<double>& w, Posed& X) {
  X.p += X.R * w.p_PL;
  if (link.rotated) X.R = X.R * link.X_PF.R;
  recursion::visit_joint(link, [&](auto joint) {
    if constexpr (!recursion::kIsRoot<decltype(joint)>) X.R = joint_rotation(joint, w, X.R);
  });
}

Posed pose_along(const std::vector<int>& from, const Tree<double>& tree, std::span<const LinkScratch<double>> links) {
  Posed X = Posed::identity();
  for (std::size_t k = from.size(); k-- > 0;) step_outward(tree.links[from[k]], links[from[k]], X);
  return X;
}

Posed root_in_world(const TreeLink<double>& link, std::span<const double> q) {
  if (link.joint == JointType::fixed) return link.X_PF;
  return {rotation_matrix(Quaterniond{q[link.q + 3], q[link.q + 4], q[link.q + 5], q[link.q + 6]}),
          {q[link.q], q[link.q + 1], q[link.q + 2]}};
}

void step_quaternion(double* q, const Vector3d& turn) {
  const double angle = norm(turn), half = 0.5 * angle;
  // sin(a/2)/a without division by zero.
  const double f = angle > 1e-8 ? std::sin(half) / angle : 0.5;
  Quaterniond p =
      Quaterniond{q[0], q[1], q[2], q[3]} * Quaterniond{std::cos(half), f * turn[0], f * turn[1], f * turn[2]};
  const double scale = 1 / std::sqrt(p.w * p.w + p.x * p.x + p.y * p.y + p.z * p.z);
  q[0] = scale * p.w, q[1] = scale * p.x, q[2] = scale * p.y, q[3] = scale * p.z;
}

// Whether a pose is finite and its matrix is a rotation.
bool is_placement(const Posed& X) {
  const Rotationd R = transpose(X.R) * X.R;
  double worst = 0;
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) worst = std::max(worst, std::abs(R.m[i][j] - (i == j ? 1 : 0)));
  }
  return worst < 1e-9 && std::isfinite(dot(X.p, X.p) + worst);
}

}  // namespace

// Closure => path: links and poses on both sides, chains to the common ancestor or the roots, angular rows and scales.
// @throws std::invalid_argument as documented in the header.
LoopPath make_loop_path(const Model& model, const LoopClosure& closure) {
  const int bodies = static_cast<int>(model.bodies().size());
  if (closure.body_a < 0 || closure.body_a >= bodies || closure.body_b < 0 || closure.body_b >= bodies)
    throw std::invalid_argument("loop closure '" + closure.name + "': no such body");
  if (!is_placement(closure.X_AC) || !is_placement(closure.X_BD) ||
      !(std::abs(norm(closure.hinge_C) - 1) < 1e-9 || !turns_about_axis(closure.model)))
    throw std::invalid_argument("loop closure '" + closure.name +
                                "': a frame is not a valid pose, or the hinge is not a unit vector");
  const Body& a = model.bodies()[closure.body_a];
  const Body& b = model.bodies()[closure.body_b];
  const Tree<double>& tree = model.tree();
  const auto is_ground = [&](int link) { return tree.links[link].joint == JointType::fixed; };
  if (a.placement.link == b.placement.link || (is_ground(a.placement.link) && is_ground(b.placement.link))) {
    throw std::invalid_argument("loop closure '" + closure.name + "': bodies '" + a.description.name + "' and '" +
                                b.description.name + "' have no relative motion");
  }
  LoopPath path;
  path.link_a = a.placement.link, path.link_b = b.placement.link;
  path.X_aC = a.placement.X_LB * closure.X_AC;
  path.X_bD = b.placement.X_LB * closure.X_BD;
  path.from_a = links_to_root(tree, path.link_a);
  path.from_b = links_to_root(tree, path.link_b);
  path.root_a = path.from_a.back(), path.root_b = path.from_b.back();
  if (!path.one_tree()) path.from_a.pop_back(), path.from_b.pop_back();
  while (!path.from_a.empty() && !path.from_b.empty() && path.from_a.back() == path.from_b.back()) {
    path.trunk.push_back(path.from_a.back());
    path.from_a.pop_back(), path.from_b.pop_back();
  }
  std::reverse(path.trunk.begin(), path.trunk.end());
  path.rows = row_count(closure.model);
  path.angular_count = forbidden_turns(closure, path.angular_rows);
  path.model = closure.model;
  path.hinge_C = closure.hinge_C;
  LoneBody(b).scale_rows(path.X_bD.p, path);
  return path;
}

std::vector<CouplingPath> make_coupling_paths(const Model& model, int first_row) {
  std::vector<CouplingPath> paths;
  for (const JointCoupling& coupling : model.couplings()) {
    CouplingPath& path = paths.emplace_back();
    for (const auto& [body, factor] : coupling.joints) {
      const Body& b = model.bodies()[body];
      path.joints.push_back({b.placement.link, b.q, b.v, factor});
    }
    path.offset = coupling.offset;
    path.row = first_row++;
    path.scale = coupling_scale(model, coupling);
    path.slides = slides_along_axis(model.bodies()[dependent_body(coupling)].description.joint.type);
  }
  return paths;
}

double coupling_position(const CouplingPath& path, std::span<const double> q) {
  double sum = -path.offset;
  for (const CouplingPath::Joint& joint : path.joints) sum += joint.factor * q[joint.q];
  return sum;
}

double coupling_motion(const CouplingPath& path, std::span<const double> v) {
  double sum = 0;
  for (const CouplingPath::Joint& joint : path.joints) sum += joint.factor * v[joint.v];
  return sum;
}

double coupling_motion_size(const CouplingPath& path, std::span<const double> v, double least) {
  double sum = 0;
  for (const CouplingPath::Joint& joint : path.joints)
    sum += std::abs(joint.factor) * std::max(std::abs(v[joint.v]), least);
  return sum;
}

LoneBody::LoneBody(const Body& body)
    : inverse_mass(1 / body.description.mass), com(body.placement.X_LB * body.description.com) {
  const Symmetric3d I = rotate(body.placement.X_LB.R, body.description.inertia);
  const double c_xx = I.yy * I.zz - I.yz * I.yz, c_yy = I.xx * I.zz - I.xz * I.xz, c_zz = I.xx * I.yy - I.xy * I.xy;
  const double c_xy = I.xz * I.yz - I.xy * I.zz, c_xz = I.xy * I.yz - I.xz * I.yy, c_yz = I.xy * I.xz - I.yz * I.xx;
  const double f = 1 / (I.xx * c_xx + I.xy * c_xy + I.xz * c_xz);
  inverse_inertia = {f * c_xx, f * c_yy, f * c_zz, f * c_xy, f * c_xz, f * c_yz};
}

// Mean inverse inertias about the point: a third of the traces of I_c^-1 and of 1/m - [r x] I_c^-1 [r x]. The trace of
// -[r x] A [r x] is |r|^2 tr A - r^T A r.
void LoneBody::scale_rows(const Vector3d& p, LoopPath& path) const {
  const Vector3d r = p - com;
  const double trace = inverse_inertia.xx + inverse_inertia.yy + inverse_inertia.zz;
  path.angular_scale = 1 / std::sqrt(trace / 3);
  path.linear_scale = 1 / std::sqrt(inverse_mass + (dot(r, r) * trace - dot(r, inverse_inertia * r)) / 3);
}

LoopPlace locate(const LoopPath& path, const Tree<double>& tree, std::span<const LinkScratch<double>> links,
                 std::span<const double> q) {
  Posed X_LC = pose_along(path.from_a, tree, links) * path.X_aC;
  const Posed X_Lb = pose_along(path.from_b, tree, links);
  if (!path.one_tree()) {
    // From root a's frame to root b's. Far from the world's origin only the distance of the roots matters.
    const Posed X_Wa = root_in_world(tree.links[path.root_a], q), X_Wb = root_in_world(tree.links[path.root_b], q);
    X_LC = Posed{transpose(X_Wb.R) * X_Wa.R, transposed_times(X_Wb.R, X_Wa.p - X_Wb.p)} * X_LC;
  }
  return {inverse(X_Lb) * X_LC};
}

void step_coordinates(const Tree<double>& tree, std::span<const double> dq, std::span<double> q) {
  for (const TreeLink<double>& link : tree.links) {
    const JointTraits& joint = traits_of(link.joint);
    if (joint.quaternion < 0) {
      for (int k = 0; k < joint.velocities; ++k) q[link.q + k] += dq[link.v + k];
      continue;
    }
    double* turn = &q[link.q + joint.quaternion];
    if (joint.position >= 0) {
      const Vector3d p = rotation_matrix(Quaterniond{turn[0], turn[1], turn[2], turn[3]}) *
                         Vector3d{dq[link.v + 3], dq[link.v + 4], dq[link.v + 5]};
      for (int k = 0; k < 3; ++k) q[link.q + joint.position + k] += p[k];
    }
    step_quaternion(turn, {dq[link.v], dq[link.v + 1], dq[link.v + 2]});
  }
}

// Place of a closure => pose of D in C, whose deviation from the identity is the defect (8.4).
Posed pose_CD(const LoopPath& path, const LoopPlace& place) { return inverse(place.X_bC) * path.X_bD; }

// Place of a closure => position defect as rows of C minus D, rotations as rotation vectors (8.4).
void position_rows(const LoopPath& path, const LoopPlace& place, std::span<double> rows) {
  const Posed X_CD = pose_CD(path, place);
  Vector3d turn;  // of D relative to C; the full angle, since the sine vanishes at half a turn as well
  if (path.model == GraspModel::rigid || path.model == GraspModel::orientation) {
    turn = rotation_vector(X_CD.R);
  } else if (turns_about_axis(path.model)) {
    const Vector3d axis = X_CD.R * path.hinge_C;
    turn = cross(path.hinge_C, axis);
    const double sine = norm(turn), cosine = dot(path.hinge_C, axis);
    if (sine > 0) {
      turn = (std::atan2(sine, cosine) / sine) * turn;
    } else if (cosine < 0) {
      turn = std::numbers::pi * path.angular_rows[0];  // about an arbitrary normal
    }
  } else {
    turn = Vector3d::zero();
  }
  for (int r = 0; r < path.angular_count; ++r) rows[r] = -dot(path.angular_rows[r], turn);
  for (int r = 0; r < path.linear_count(); ++r) rows[path.angular_count + r] = -X_CD.p[r];
}

}  // namespace grapnel
