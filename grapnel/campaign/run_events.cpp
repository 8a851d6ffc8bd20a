#include "grapnel/campaign/run_events.hpp"

#include <fmt/format.h>

#include <map>

#include "grapnel/problem/enumeration_names.hpp"
#include "grapnel/result/result_documents.hpp"

namespace grapnel {

template <>
const Type& type_of<LawEnd>();  // of grapnel/result/drive_fields.cpp

namespace {

// Properties in the order of their first names; texts of one name are joined.
class EventList {
 public:
  void add(const std::string& name, const std::string& text) {
    for (auto& [key, present] : events_) {
      if (key != name) continue;
      present += ", " + text;
      return;
    }
    events_.emplace_back(name, text);
  }
  template <class T>
  void count(const std::string& name, T number) {
    add(name, fmt::format("{}", number));
  }
  std::vector<std::pair<std::string, std::string>> take() { return std::move(events_); }

 private:
  std::vector<std::pair<std::string, std::string>> events_;
};

void add_grasps(const CaptureResult& result, EventList& list) {
  for (const GraspOutcome& grasp : result.grasps) {
    list.add("grasp " + grasp.end_effector, fmt::format("{}{}{}", grasp.captured ? "closed" : "open",
                                                        grasp.lost ? ", lost" : "", grasp.slipped ? ", slipped" : ""));
  }
  list.count("impacts", result.impacts.size());
  for (const ImpactReport& impact : result.impacts) {
    list.add("rank of the impacts", fmt::format("{} of {}", impact.rank, impact.rows));
    for (const GraspImpulse& grasp : impact.grasps) {
      if (!grasp.rebound) continue;
      std::string modes;
      for (const std::string& mode : grasp.rebound->modes) modes += (modes.empty() ? "" : " then ") + mode;
      list.add("contact of " + grasp.end_effector, modes);
    }
    for (const HeldJoint& held : impact.held_joints) {
      if (held.was_overpowered) list.add("overpowered drives", held.joint);
    }
    if (impact.compliant) list.add("end of the compliant impact", impact.compliant->end);
  }
  for (const ReleaseReport& one : result.releases) {
    for (const std::string& name : one.end_effectors) list.add("releases", name);
  }
  for (const LossReport& one : result.losses) list.add("losses under load", one.end_effector);
  for (const SlipReport& one : result.slips) list.add("slips", one.end_effector);
}

void add_motion(const CaptureResult& result, EventList& list) {
  for (const MotionPhaseReport& phase : result.phases)
    list.add("phases", phase.name + (phase.ended == MotionPhaseReport::End::condition ? " until its condition" : ""));
  for (const LawReport& law : result.laws)
    list.add("ends of laws", name_of(law.ended) + (law.joint.empty() ? "" : ": " + law.joint));
  for (const JointReport& joint : result.joints) {
    if (joint.sticks + joint.breakaways + joint.stop_impacts == 0) continue;
    list.add("joint " + joint.joint, fmt::format("{} sticks, {} breakaways and {} stop impacts in {}", joint.sticks,
                                                 joint.breakaways, joint.stop_impacts, joint.phase));
  }
  for (const ContactPairReport& pair : result.contacts) {
    if (pair.touches == 0) continue;
    list.add("contacts of " + pair.body_a + " and " + pair.body_b,
             pair.hard ? fmt::format("{} touches, {} impacts", pair.touches, pair.hard->impacts)
                       : fmt::format("{} touches", pair.touches));
  }
  for (const StagesReport& one : result.stages) {
    const bool failed = one.failure != StagesReport::Failure::none;
    list.add("stages of " + one.target,
             fmt::format("{}{}{}", name_of(one.reached), failed ? ", " : "", failed ? name_of(one.failure) : ""));
  }
  for (const LimitEvent& limit : result.limit_events) {
    if (limit.kind == LimitKind::effort_saturated) list.add("saturated efforts", limit.joint);
  }
  if (result.thrusters) {
    for (const ThrusterReport& one : result.thrusters->each) list.count("firings of " + one.name, one.firings);
    if (result.thrusters->dumping) list.count("dumpings", result.thrusters->dumping->begun);
  }
  std::map<std::string, std::string> saturated;  // by name: their order is that of their durations
  for (const SaturationReport& one : result.saturation) saturated[one.name] += "+";
  for (const auto& [name, times] : saturated) list.add("saturated actuators", name);
}

}  // namespace

std::vector<std::pair<std::string, std::string>> run_events(const CaptureResult& result) {
  EventList list;
  add_grasps(result, list);
  add_motion(result, list);
  return list.take();
}

}  // namespace grapnel
