#include "bench/flexible_workload.hpp"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <stdexcept>

#include "grapnel/dynamics/elastic_modes.hpp"
#include "grapnel/problem/flexible_bodies.hpp"

namespace grapnel::bench {
namespace {

constexpr double kLength = 1, kMass = 10, kStiffness = 2117;  // a link of the workloads; E I of the thesis's robot
constexpr double kThick = 1e-4;                               // inertia of the section, of the whole link [kg m^2]
constexpr double kAccuracy = 0.01;
// 1 + cos b cosh b = 0.
constexpr std::array kClamped{1.87510406871, 4.69409113297, 7.85475743824, 10.9955407349};

// The segments of a link divided at the middles of n parts: hinges with k = E I / h.
void add_by_middles(const BodyDescription& link, int n, std::vector<BodyDescription>& bodies) {
  const double h = kLength / n;
  BodyDescription piece = link;
  for (int i = 0; i <= n; ++i) {
    const double length = i == 0 || i == n ? 0.5 * h : h;
    if (i > 0) {
      piece = BodyDescription{};
      piece.name = fmt::format("{}:{}", link.name, i), piece.parent = bodies.back().name;
      piece.X_PF.p = {i == 1 ? 0.5 * h : h, 0, 0};
      piece.joint.name = piece.name, piece.joint.type = JointType::continuous, piece.joint.axis = link.joint.axis;
      piece.joint.spring = JointSpring{kStiffness / h, 0, 0};
    }
    piece.mass = kMass * length / kLength, piece.com = {0.5 * length, 0, 0};
    const double across = piece.mass * length * length / 12;
    const double thick = kThick * length / kLength;
    piece.inertia = Symmetric3d::diagonal(thick, across + thick, across + thick);
    bodies.push_back(piece);
  }
}

std::vector<BodyDescription> cut_link(BodyDescription link, Cut cut, int n) {
  std::vector<BodyDescription> bodies;
  if (cut == Cut::middles) {
    add_by_middles(link, n, bodies);
    return bodies;
  }
  RobotSetup robot;
  BeamDescription beam;
  beam.to = {kLength, 0, 0};
  (link.joint.axis[1] != 0 ? beam.bending_stiffness_y : beam.bending_stiffness_z) = kStiffness;
  beam.segments = n;
  link.beam = beam;
  BodyDescription base;
  base.name = link.parent, base.mass = 1, base.inertia = Symmetric3d::diagonal(1, 1, 1);
  robot.bodies = {base, link};
  const RobotSetup flexible = flexible_robot(robot);
  bodies.assign(flexible.bodies.begin() + 1, flexible.bodies.end());
  for (BodyDescription& body : bodies) body.part_of.clear();
  return bodies;
}

BodyDescription link_of(const std::string& name, const std::string& parent, JointType type) {
  BodyDescription link;
  link.name = name, link.parent = parent, link.joint.name = name, link.joint.type = type;
  link.mass = kMass, link.com = {0.5 * kLength, 0, 0};
  const double across = kMass * kLength * kLength / 12 + kThick;
  link.inertia = Symmetric3d::diagonal(kThick, across, across);
  return link;
}

double error_of(Cut cut, int n, int modes) {
  ModelBuilder builder;
  BodyDescription base;
  base.name = base.joint.name = "base", base.mass = 1, base.inertia = Symmetric3d::diagonal(1, 1, 1);
  builder.add(base);
  for (const BodyDescription& body : cut_link(link_of("link", "base", JointType::fixed), cut, n)) builder.add(body);
  const Model model = builder.build();
  const auto found = elastic_modes(model, zero_state(model), {});
  double worst = 0;
  for (int k = 0; k < modes; ++k) {
    if (k >= static_cast<int>(found.size())) return 1;
    const double b = kClamped[static_cast<std::size_t>(k)];
    const double exact = b * b / (kLength * kLength) * std::sqrt(kStiffness * kLength / kMass) / 6.283185307179586;
    worst = std::max(worst, std::abs(found[static_cast<std::size_t>(k)].frequency / exact - 1));
  }
  return worst;
}

FlexibleWorkload make(const std::string& name, int arms, int joints, bool alternate, int modes, Cut cut) {
  FlexibleWorkload result;
  int n = 1;
  while ((result.error = error_of(cut, n, modes)) > kAccuracy) {
    if (++n > 60) throw std::runtime_error("flexible_targets: no cut is fine enough");
  }
  ModelBuilder builder;
  std::string last;
  const Model rigid = describe_robot(arms, joints, alternate).build();
  for (const Body& body : rigid.bodies()) {
    if (body.parent < 0) {
      builder.add(body.description);
      continue;
    }
    BodyDescription link = link_of(body.description.name, body.description.parent, JointType::revolute);
    link.joint.axis = body.description.joint.axis, link.X_PF = body.description.X_PF;
    if (rigid.bodies()[static_cast<std::size_t>(body.parent)].parent >= 0) {  // on the last segment of its parent
      link.parent = last;
      link.X_PF.p[0] = kLength;
    }
    const std::vector<BodyDescription> pieces = cut_link(link, cut, n);
    double at = 0;
    for (std::size_t i = 1; i < pieces.size(); ++i) at += pieces[i].X_PF.p[0];
    for (const BodyDescription& piece : pieces) {
      BodyDescription placed = piece;
      if (&piece == &pieces.front() && !last.empty() && link.parent == last) placed.X_PF.p[0] = kLength - at;
      builder.add(placed);
    }
    last = pieces.back().name;
    result.hinges = static_cast<int>(pieces.size()) - 1;
  }
  result.workload = make_workload(name, builder.build());
  return result;
}

}  // namespace

std::string FlexibleWorkload::description() const {
  return fmt::format("{} hinges in a link, frequencies within {:.2g}", hinges, error);
}

std::vector<FlexibleWorkload> flexible_targets(Cut cut) {
  std::vector<FlexibleWorkload> targets;
  targets.push_back(make("a_flexible", 2, 3, false, 3, cut));
  targets.push_back(make("b_flexible", 2, 7, true, 2, cut));
  return targets;
}

}  // namespace grapnel::bench
