#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "grapnel/import/assembly_steps.hpp"
#include "grapnel/model/model.hpp"
#include "grapnel/text/message_text.hpp"
#include "grapnel/text/yaml_values.hpp"

namespace grapnel {
namespace {

// How far a rotor may be from a balanced one: its centre of mass from the axis, against its radius of gyration; its
// axis from a principal one, and its moments across it from each other, against that about it.
constexpr double kUnbalanced = 1e-2;

// What turns with a wheel's joint, in the base's frame.
struct Rotor {
  RigidBodyInertiad inertia = RigidBodyInertiad::zero();
  Vector3d axis, point;  // of the joint
};

class WheelMaker {
 public:
  WheelMaker(const SourceModel& model, const LinkTree& tree, const GroupedLinks& grouped,
             std::vector<ImportDecision>& decisions, FaultList& faults)
      : model_(model), tree_(tree), grouped_(grouped), decisions_(decisions), faults_(faults) {
    for (const GroupedLink& one : grouped.groups[0].links) places_.emplace(one.link, one.X_GL);
  }

  // Empty after a fault.
  std::optional<WheelOfJoint> make(int j, const Mark& mark) {
    const SourceJoint& joint = model_.joints[j];
    WheelOfJoint wheel;
    wheel.joint = j;
    const auto rotor = rotor_of(j, mark, wheel.links);
    if (!rotor) return {};
    const std::string named = "joint " + in_quotes(joint.name);
    const double mass = rotor->inertia.mass;
    const Vector3d a = rotor->axis;
    const Symmetric3d I = mass > 0 ? rotor->inertia.rotational_about_com() : Symmetric3d::zero();
    const Vector3d Ia = I * a;
    const double J = dot(a, Ia);
    if (!(J > 0)) {
      faults_.add(mark, fmt::format("{} cannot be a wheel: what it turns has no inertia about its axis", named));
      return {};
    }
    const Vector3d from_axis = cross(a, rotor->inertia.com() - rotor->point);
    const double across = I.xx + I.yy + I.zz - J, spread = spread_across(I, a);
    if (norm(from_axis) > kUnbalanced * std::sqrt(J / mass) || norm(Ia - J * a) > kUnbalanced * J ||
        spread > kUnbalanced * std::max(J, across)) {
      faults_.add(
          mark, fmt::format("{} cannot be a wheel, which is a balanced rotor: its centre of mass is {:.3g} m from the "
                            "axis, its product of inertia {:.3g}, and its moments across the axis differ by {:.3g} of "
                            "{:.3g} kg m^2",
                            named, norm(from_axis), norm(Ia - J * a), spread, J));
      return {};
    }
    wheel.axis = a;
    wheel.inertia = J + joint.gear_ratio * joint.gear_ratio * joint.rotor_inertia;
    decisions_.push_back({joint.mark,
                          fmt::format("{} becomes a reaction wheel of {:.6g} kg m^2, as asked for; the mass of what it "
                                      "turns is part of the base",
                                      named, wheel.inertia),
                          joint.name});
    return wheel;
  }

 private:
  // How much the moments of inertia across the axis differ.
  static double spread_across(const Symmetric3d& I, const Vector3d& a) {
    const Vector3d helper = std::abs(a[0]) < 0.6 ? Vector3d{1, 0, 0} : Vector3d{0, 1, 0};
    Vector3d u = cross(a, helper);
    u = (1 / norm(u)) * u;
    const Vector3d v = cross(a, u);
    return std::hypot(dot(u, I * u) - dot(v, I * v), 2 * dot(u, I * v));
  }

  std::optional<Rotor> rotor_of(int j, const Mark& mark, std::vector<int>& links) {
    const SourceJoint& joint = model_.joints[j];
    const auto refuse = [&](const std::string& why) {
      faults_.add(mark, fmt::format("joint {} cannot be a wheel: {}", in_quotes(joint.name), why));
      return std::nullopt;
    };
    if (joint.kind != SourceJoint::Kind::revolute && joint.kind != SourceJoint::Kind::continuous)
      return refuse("it does not turn about an axis");
    const auto carrier = places_.find(tree_.parent[j]);
    if (carrier == places_.end())
      return refuse(fmt::format("link {}, which carries it, is no part of the base", in_quotes(joint.parent)));
    Rotor rotor;
    const Posed X_GJ = carrier->second * joint.X_PJ;
    rotor.axis = X_GJ.R * joint.axis, rotor.point = X_GJ.p;
    links = {tree_.child[j]};
    for (std::size_t i = 0; i < links.size(); ++i) {
      const SourceLink& link = model_.links[links[i]];
      const auto place = places_.find(links[i]);
      if (place == places_.end())
        return refuse(fmt::format("link {} beyond it moves by itself; lock its joint", in_quotes(link.name)));
      if (links[i] == grouped_.groups[0].links[0].link) return refuse("the base is beyond it");
      if (link.inertia && link.inertia->mass > 0)
        rotor.inertia +=
            place->second * RigidBodyInertiad::about_com(link.inertia->mass, link.inertia->com, link.inertia->inertia);
      for (const int below : tree_.child_joints[links[i]]) links.push_back(tree_.child[below]);
    }
    return rotor;
  }

  const SourceModel& model_;
  const LinkTree& tree_;
  const GroupedLinks& grouped_;
  std::vector<ImportDecision>& decisions_;
  FaultList& faults_;
  std::map<int, Posed> places_;  // of links in the base
};

}  // namespace

std::vector<WheelOfJoint> wheels_of_joints(const SourceModel& model, const LinkTree& tree, const GroupedLinks& grouped,
                                           const ImportOptions& options, std::vector<ImportDecision>& decisions,
                                           FaultList& faults) {
  WheelMaker maker(model, tree, grouped, decisions, faults);
  const auto joints = indices_of(model.joints);
  std::vector<WheelOfJoint> wheels;
  for (const StatedName& requested : options.wheels) {
    const auto it = joints.find(requested.name);
    if (it == joints.end() || faults.full()) continue;  // has been reported
    if (auto wheel = maker.make(it->second, requested.mark)) wheels.push_back(std::move(*wheel));
  }
  return wheels;
}

}  // namespace grapnel
