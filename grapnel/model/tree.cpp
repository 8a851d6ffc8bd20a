#include "grapnel/model/tree.hpp"

#include <fmt/format.h>

#include <cmath>
#include <map>
#include <optional>

#include "grapnel/model/model.hpp"

namespace grapnel {
namespace {

// Products of a few rotation matrices have errors of about 1e-16; an axis closer than this to a coordinate axis is
// treated as one.
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

// One Newton step towards the nearest rotation, R (3 - R^T R) / 2. Without it, a frame defined through the error of its
// parent (R_PL = X_LF.R below, so X_LB = R^T R) would double that error with every link of a chain.
Rotationd orthonormalized(const Rotationd& R) {
  const Rotationd G = transpose(R) * R;
  Rotationd half{};
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) half(i, j) = ((i == j ? 3.0 : 0.0) - G(i, j)) / 2;
  }
  return R * half;
}

// Orientation of the link's internal frame in its parent's internal frame at zero joint angle, and the axis in it.
struct Alignment {
  Rotationd R_PL;
  bool rotated;
  SignedAxis axis;
};

Alignment choose_frame(const Rotationd& R_PF, const Vector3d& axis_F) {
  const Vector3d axis_P = R_PF * axis_F;
  if (const auto axis = coordinate_axis(axis_P)) return {Rotationd::identity(), false, *axis};
  // The user's joint frame: outer joints are often aligned with it.
  if (const auto axis = coordinate_axis(axis_F)) return {R_PF, true, *axis};
  return {rotation_between({0, 0, 1}, axis_P), true, {2, 1.0}};
}

// A column is dependent if the part orthogonal to the previous columns is below this share of its length.
constexpr double kIndependent = 1e-9;

double column_product(const std::vector<double>& A, int columns, int a, int b) {
  double sum = 0;
  for (std::size_t row = 0; row < A.size(); row += static_cast<std::size_t>(columns))
    sum += A[row + static_cast<std::size_t>(a)] * A[row + static_cast<std::size_t>(b)];
  return sum;
}

// Modified Gram-Schmidt, applied twice. Returns whether the columns are independent.
bool orthonormalize(std::vector<double>& A, int columns) {
  const auto at = [&](std::size_t row, int column) -> double& { return A[row + static_cast<std::size_t>(column)]; };
  for (int c = 0; c < columns; ++c) {
    const double length = std::sqrt(column_product(A, columns, c, c));
    for (int pass = 0; pass < 2; ++pass) {
      for (int b = 0; b < c; ++b) {
        const double share = column_product(A, columns, b, c);
        for (std::size_t row = 0; row < A.size(); row += static_cast<std::size_t>(columns))
          at(row, c) -= share * at(row, b);
      }
    }
    const double left = std::sqrt(column_product(A, columns, c, c));
    if (!(left > kIndependent * length) || !std::isfinite(left)) return false;
    for (std::size_t row = 0; row < A.size(); row += static_cast<std::size_t>(columns)) at(row, c) /= left;
  }
  return true;
}

// Bodies grouped by the name of their joints' chain, parents first.
std::map<std::string, std::vector<std::size_t>> bodies_of_chains(const std::vector<BodyDescription>& bodies) {
  std::map<std::string, std::vector<std::size_t>> chains;
  for (std::size_t i = 0; i < bodies.size(); ++i) {
    if (const auto& modal = bodies[i].joint.modal) chains[modal->chain].push_back(i);
  }
  return chains;
}

}  // namespace

// Sorted bodies => errors of chains of joints that move by modes (docs/theory, chapter 4): chains with a gap, rotors,
// or modes that are dependent or not as many as each other.
std::vector<std::string> chain_faults(const std::vector<BodyDescription>& bodies, const std::vector<int>& parent) {
  std::vector<std::string> faults;
  for (const auto& chain : bodies_of_chains(bodies)) {
    const std::string& name = chain.first;
    const std::vector<std::size_t>& members = chain.second;
    const auto fault = [&](const char* text) {
      faults.push_back(fmt::format("joints '{}' that move by modes: {}", name, text));
    };
    const std::size_t count = bodies[members.front()].joint.modal->rates.size();
    std::vector<double> shapes;
    bool plain = true;
    for (std::size_t k = 0; k < members.size(); ++k) {
      const JointDescription& joint = bodies[members[k]].joint;
      plain = plain && has_one_axis(joint.type) && parent[members[k]] >= 0 && joint.reflected_inertia() == 0;
      if (joint.modal->rates.size() != count) plain = false;
      shapes.insert(shapes.end(), joint.modal->rates.begin(), joint.modal->rates.end());
      if (k == 0) continue;
      int carrier = parent[members[k]];  // fixed bodies may be in between
      while (carrier >= 0 && bodies[carrier].joint.type == JointType::fixed) carrier = parent[carrier];
      if (carrier != static_cast<int>(members[k - 1])) fault("each must be on the body of the one before it");
    }
    if (!plain) {
      fault("they have one axis each, no rotor, and as many modes as each other");
    } else if (count == 0 || count > members.size() || !orthonormalize(shapes, static_cast<int>(count))) {
      fault("modes must be independent, at least one and at most as many as joints");
    }
  }
  return faults;
}

// Sorted bodies => links with frames aligned to their axes (4.13) and, in `placements`, link and pose of each body.
// Fixed bodies join the link that carries them; chains of modal joints get orthonormal shapes.
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
  for (const auto& [name, members] : bodies_of_chains(bodies)) {
    ModalChain chain;
    for (const std::size_t i : members) {
      TreeLink<double>& link = tree.links[placements[i].link];
      link.chain = static_cast<int>(tree.chains.size()), link.member = static_cast<int>(chain.links.size());
      chain.links.push_back(placements[i].link), chain.velocities.push_back(v[i]);
      const std::vector<double>& rates = bodies[i].joint.modal->rates;
      chain.modes = static_cast<int>(rates.size());
      chain.shapes.insert(chain.shapes.end(), rates.begin(), rates.end());
    }
    orthonormalize(chain.shapes, chain.modes);
    tree.chains.push_back(std::move(chain));
  }
  return tree;
}

}  // namespace grapnel
