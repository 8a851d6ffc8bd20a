#include "import/source_assembly.hpp"

#include <map>
#include <stdexcept>
#include <string>
#include <vector>

namespace grapnel::testing {
namespace {

struct Lump {
  int carrier = -1;                // the link whose joint moves it; for the base, the index of the root
  Posed X_CL = Posed::identity();  // in the carrier's frame
};

JointDescription moving(const SourceJoint& joint) {
  using Kind = SourceJoint::Kind;
  JointDescription d;
  d.name = joint.name;
  d.type = joint.kind == Kind::prismatic  ? JointType::prismatic
           : joint.kind == Kind::revolute ? JointType::revolute
                                          : JointType::continuous;
  d.axis = joint.axis;
  if (joint.lower) d.limits.lower = *joint.lower;
  if (joint.upper) d.limits.upper = *joint.upper;
  if (joint.effort) d.limits.effort = *joint.effort;
  d.friction.viscous = joint.viscous_friction;
  d.friction.coulomb = joint.coulomb_friction;
  d.rotor_inertia = joint.rotor_inertia;
  d.gear_ratio = joint.gear_ratio;
  return d;
}

}  // namespace

Model assemble_source(const SourceModel& source, bool free_root) {
  std::map<std::string, int> index;
  for (std::size_t i = 0; i < source.links.size(); ++i) index[source.links[i].name] = static_cast<int>(i);
  std::vector<const SourceJoint*> carrier(source.links.size(), nullptr);
  for (const SourceJoint& joint : source.joints) carrier.at(index.at(joint.child)) = &joint;

  // Readers list parents before children.
  std::vector<Lump> lumps(source.links.size());
  std::vector<RigidBodyInertiad> inertia(source.links.size(), RigidBodyInertiad::zero());
  for (std::size_t i = 0; i < source.links.size(); ++i) {
    const SourceJoint* joint = carrier[i];
    if (joint != nullptr && joint->kind == SourceJoint::Kind::fixed) {
      const Lump& parent = lumps[index.at(joint->parent)];
      if (parent.carrier < 0) throw std::runtime_error("links are not parents first");
      lumps[i] = {parent.carrier, parent.X_CL * joint->X_PJ};
    } else {
      lumps[i] = {static_cast<int>(i), Posed::identity()};
    }
    if (const auto& own = source.links[i].inertia)
      inertia[lumps[i].carrier] += lumps[i].X_CL * RigidBodyInertiad::about_com(own->mass, own->com, own->inertia);
  }

  ModelBuilder builder;
  for (std::size_t i = 0; i < source.links.size(); ++i) {
    if (lumps[i].carrier != static_cast<int>(i)) continue;
    const SourceJoint* joint = carrier[i];
    BodyDescription body;
    body.name = source.links[i].name;
    RigidBodyInertiad own = inertia[i];
    if (joint == nullptr) {
      body.joint.type = free_root ? JointType::free : JointType::fixed;
      body.joint.name = "root";
      // The mass of a fixed root has no influence but must be positive.
      if (!free_root && !(own.mass > 0))
        own = RigidBodyInertiad::about_com(1, Vector3d::zero(), Symmetric3d::diagonal(1, 1, 1));
    } else {
      const Lump& parent = lumps[index.at(joint->parent)];
      body.parent = source.links[parent.carrier].name;
      body.X_PF = parent.X_CL * joint->X_PJ;
      body.joint = moving(*joint);
    }
    body.mass = own.mass, body.com = own.com(), body.inertia = own.rotational_about_com();
    builder.add(std::move(body));
  }
  for (const SourceFrame& frame : source.frames) {
    const Lump& lump = lumps[index.at(frame.link)];
    builder.add(FrameDescription{frame.name, source.links[lump.carrier].name, lump.X_CL * frame.X_LF});
  }
  return builder.build();
}

}  // namespace grapnel::testing
