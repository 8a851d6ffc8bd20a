#include "grapnel/model/tree.hpp"

#include <cmath>
#include <optional>

namespace grapnel {
namespace {

// Products of a few rotation matrices carry errors of some 1e-16; an axis closer than this to a coordinate axis is one.
constexpr double kAlignment = 4e-15;

struct SignedAxis {
  std::uint8_t axis;
  double sign;
};

std::optional<SignedAxis> coordinate_axis(const Vector3d& a) {
  for (int k = 0; k < 3; ++k) {
    if (std::abs(a[(k + 1) % 3]) < kAlignment && std::abs(a[(k + 2) % 3]) < kAlignment) {
      return SignedAxis{static_cast<std::uint8_t>(k), a[k] < 0 ? -1.0 : 1.0};
    }
  }
  return std::nullopt;
}

// One Newton step towards the nearest rotation, R (3 - R^T R) / 2. Without it a frame that is set along its parent's
// error (R_PL = X_LF.R below, hence X_LB = R^T R) would double that error with every link of a chain.
Rotationd orthonormalized(const Rotationd& R) {
  const Rotationd G = transpose(R) * R;
  Rotationd half{};
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) half(i, j) = ((i == j ? 3.0 : 0.0) - G(i, j)) / 2;
  }
  return R * half;
}

// Orientation of the link's internal frame in its parent's internal frame at zero joint angle, with the axis in it.
struct Alignment {
  Rotationd R_PL;
  bool rotated;
  SignedAxis axis;
};

Alignment choose_frame(const Rotationd& R_PF, const Vector3d& axis_F) {
  const Vector3d axis_P = R_PF * axis_F;
  if (const auto axis = coordinate_axis(axis_P)) return {Rotationd::identity(), false, *axis};
  // The user's own joint frame: joints further out often align with it.
  if (const auto axis = coordinate_axis(axis_F)) return {R_PF, true, *axis};
  return {rotation_between({0, 0, 1}, axis_P), true, {2, 1.0}};
}

}  // namespace

Tree<double> make_tree(const std::vector<BodyDescription>& bodies, const std::vector<int>& parent,
                       const std::vector<int>& q, const std::vector<int>& v, std::vector<BodyPlacement>& placements) {
  Tree<double> tree;
  placements.clear();
  for (std::size_t i = 0; i < bodies.size(); ++i) {
    const BodyDescription& body = bodies[i];
    const JointType type = body.joint.type;
    const RigidBodyInertiad inertia = RigidBodyInertiad::about_com(body.mass, body.com, body.inertia);
    tree.coordinates += coordinate_count(type);
    tree.velocities += velocity_count(type);
    if (parent[i] < 0 && (type == JointType::free || type == JointType::fixed)) {
      // A root: for a fixed one X_PF is its pose in the world.
      const int link = static_cast<int>(tree.links.size());
      const bool rotated = type == JointType::fixed;
      tree.links.push_back({-1, type, 2, rotated, q[i], v[i], 1.0,
                            type == JointType::fixed ? body.X_PF : Posed::identity(), inertia, 0.0, false});
      placements.push_back({link, Posed::identity()});
      continue;
    }
    const BodyPlacement carrier = placements[parent[i]];
    Posed X_LF = carrier.X_LB * body.X_PF;  // joint frame in the carrying link's internal frame
    X_LF.R = orthonormalized(X_LF.R);
    if (type == JointType::fixed) {
      placements.push_back({carrier.link, X_LF});
      tree.links[carrier.link].inertia += X_LF * inertia;
      continue;
    }
    Alignment alignment{X_LF.R, true, {2, 1.0}};
    if (has_one_axis(type)) alignment = choose_frame(X_LF.R, body.joint.axis);
    const JointType moves_as = type == JointType::continuous ? JointType::revolute : type;
    const int link = static_cast<int>(tree.links.size());
    // The body's axes in the internal frame, constant because both are fixed on the body.
    const Posed X_LB{orthonormalized(transpose(alignment.R_PL) * X_LF.R), Vector3d::zero()};
    tree.links.push_back({carrier.link, moves_as, alignment.axis.axis, alignment.rotated, q[i], v[i],
                          alignment.axis.sign, Posed{alignment.R_PL, X_LF.p}, X_LB * inertia,
                          body.joint.reflected_inertia(), body.joint.reflected_inertia() != 0});
    const Vector3d rotor = alignment.axis.sign * (X_LF.R * body.joint.rotor_momentum());
    if (has_one_axis(type)) tree.links.back().rotor = rotor, tree.links.back().has_rotor = dot(rotor, rotor) > 0;
    placements.push_back({link, X_LB});
  }
  return tree;
}

}  // namespace grapnel
