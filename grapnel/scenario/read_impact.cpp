#include "grapnel/scenario/read_impact.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <initializer_list>

#include "grapnel/impact_report/contact.hpp"
#include "grapnel/scenario/descriptions.hpp"
#include "grapnel/text/message_text.hpp"

namespace grapnel {
namespace {

using Law = ImpactSetup::Law;

// Keys that only some laws read: with another law they are a misunderstanding.
struct KeyUse {
  const char* key;
  std::initializer_list<Law> laws;
};
const KeyUse kUses[] = {
    {"restitution", {Law::bilateral_restitution, Law::restitution, Law::friction}},
    {"hypothesis", {Law::restitution, Law::friction}},
    {"friction", {Law::friction, Law::compliant}},
    {"contact", {Law::compliant}},
    {"grip", {Law::compliant}},
    {"longest", {Law::compliant}},
    {"settled", {Law::compliant}},
    {"joints", {Law::plastic, Law::bilateral_restitution, Law::restitution, Law::friction, Law::compliant}}};

std::string_view name_of(Law law) {
  return name_of_choice(field_named(description_at("impact"), "law")->type(), static_cast<std::int64_t>(law));
}

bool among(Law law, std::initializer_list<Law> laws) {
  for (Law l : laws) {
    if (l == law) return true;
  }
  return false;
}

// A key that was misspelt has been reported, and may not be what was meant.
bool is_reported(const Mark& mark, const FaultList& faults) {
  return std::any_of(faults.all().begin(), faults.all().end(), [&](const Fault& f) {
    return mark.source && f.file == *mark.source && f.line == mark.line && f.column == mark.column;
  });
}

void check_uses(const Node& node, Law law, FaultList& faults) {
  for (const KeyUse& use : kUses) {
    const NodeEntry* entry = node.entry(use.key);
    if (!entry || among(law, use.laws) || is_reported(entry->mark, faults)) continue;
    std::string laws;
    for (Law l : use.laws) laws += fmt::format("{}{}", laws.empty() ? "" : ", ", name_of(l));
    faults.add(entry->mark,
               fmt::format("impact.{} has no meaning with law {}; it belongs to {}", use.key, name_of(law), laws));
  }
}

void read_restitution(const Node& node, ImpactSetup& impact, FaultList& faults) {
  const Node& given = part(node, "restitution");
  if (const auto e = number_at(node, "restitution")) impact.restitution = impact.angular_restitution = *e;
  if (!given.is_mapping()) return;
  impact.restitution = number_at(given, "linear").value_or(0);
  impact.angular_restitution = number_at(given, "angular").value_or(0);
  if (given.entry("angular") && impact.law != Law::bilateral_restitution && impact.law != Law::plastic) {
    faults.add(given.entry("angular")->mark,
               "impact.restitution.angular belongs to law bilateral_restitution: a contact passes on no moment");
  }
}

// The thesis's formulas are for rigid grips of a floating robot that close all at once.
void check_published(const Mark& mark, const Reading& reading) {
  const auto undefined = [&](const std::string& why) {
    reading.faults.add(mark, fmt::format("impact.law: as_published is not defined {}; use plastic", why));
  };
  if (reading.robot.setup.base_mode == RobotSetup::Base::fixed) undefined("for a robot whose base is fixed");
  for (std::size_t i = 0; i < reading.problem.grasps.size(); ++i) {
    const GraspSetup& grasp = reading.problem.grasps[i];
    const std::string path = item("grasps", i);
    if (grasp.contact) continue;  // said by check_grasps()
    if (grasp.model != GraspModel::rigid) undefined(fmt::format("for {}, which is not rigid", path));
    if (grasp.closes != GraspSetup::Closes::together) {
      undefined(fmt::format("for {}, which does not close with the others", path));
    }
  }
}

// A contact needs a law that throws it back, and a surface.
void check_contact(const GraspSetup& grasp, const Node& node, const std::string& path, const ImpactSetup& impact,
                   const Reading& reading) {
  const Mark& mark = part(node, "model").mark;
  if (!among(impact.law, {Law::restitution, Law::friction, Law::compliant})) {
    reading.faults.add(mark, fmt::format("{}.model: contact has no meaning with impact.law {}; use restitution, "
                                         "friction or compliant, or let it grip (rigid, hinge, point)",
                                         path, name_of(impact.law)));
  }
  const GraspPoint* point = grasp_point_named(reading, grasp.target, grasp.grasp_point);
  if (!point) return;
  for (const TargetSetup& target : reading.problem.targets) {
    if (target.name != grasp.target || contact_normal(target, *point)) continue;
    reading.faults.add(mark, fmt::format("{}.model: contact needs the surface's normal: give grasp point {} of target "
                                         "{} a normal, or an approach_direction (the normal is against it)",
                                         path, in_quotes(point->name), in_quotes(grasp.target)));
    break;
  }
}

// What the law needs of the grasps.
void check_grasps(const Node& node, const ImpactSetup& impact, const Reading& reading) {
  const Node& list = part(reading.root, "grasps");
  const Mark& mark = part(node, "law").mark;
  bool any_contact = false, any_grip = false, any_turning = false;
  for (std::size_t i = 0; i < reading.problem.grasps.size(); ++i) {
    const GraspSetup& grasp = reading.problem.grasps[i];
    (grasp.contact ? any_contact : any_grip) = true;
    any_turning = any_turning || (!grasp.contact && grasp.model != GraspModel::point);
    if (grasp.contact) check_contact(grasp, list.items[i], item("grasps", i), impact, reading);
  }
  FaultList& faults = reading.faults;
  if (among(impact.law, {Law::restitution, Law::friction}) && !any_contact && any_grip) {
    faults.add(mark, fmt::format("impact.law: {} is for contacts, and every grasp here is a grip; give a grasp model: "
                                 "contact, or use law bilateral_restitution or plastic",
                                 name_of(impact.law)));
  }
  if (impact.law != Law::compliant) return;
  if (any_contact && !node.entry("contact"))
    faults.add(mark, "impact.law: compliant needs impact.contact with the stiffness of the contacts");
  if (any_grip && !node.entry("grip"))
    faults.add(mark, "impact.law: compliant needs impact.grip with the stiffness of the grips");
  if (any_turning && node.entry("grip") && !part(node, "grip").entry("angular_stiffness")) {
    faults.add(node.entry("grip")->mark,
               "missing key 'angular_stiffness' in impact.grip: rigid grips and hinges hold rotations too");
  }
}

}  // namespace

void read_impact(const Node& node, Reading& reading) {
  ImpactSetup impact;
  read_members(node, "impact", &impact);
  read_restitution(node, impact, reading.faults);
  // An unknown law is a fault already, and says nothing about the rest.
  if (!node.entry("law") || text_at(node, "law") == name_of(impact.law)) {
    check_uses(node, impact.law, reading.faults);
    if (impact.law == Law::as_published) check_published(part(node, "law").mark, reading);
    check_grasps(node, impact, reading);
  }
  reading.problem.impact = impact;
}

void check_arrival(Reading& reading) {
  const Node& list = part(reading.root, "grasps");
  if (!list.is_sequence()) return;
  const auto& approach = reading.problem.approach;
  for (std::size_t i = 0; i < list.items.size(); ++i) {
    for (const char* key : {"relative_velocity", "relative_angular_velocity"}) {
      const NodeEntry* entry = list.items[i].entry(key);
      if (!entry) continue;
      const std::string path = below(item("grasps", i), key);
      const bool angular = key == std::string_view("relative_angular_velocity");
      const auto fault = [&](const char* why) { reading.faults.add(entry->mark, fmt::format("{}: {}", path, why)); };
      if (!reading.root.entry("approach")) {
        fault("there is no approach; without one, relative motion follows from the initial state and the target's");
      } else if (approach && approach->straight_in) {
        fault("approach.straight_in says how it arrives; use its final_speed");
      } else if (approach && (approach->sampled || !approach->pieces.empty() ||
                              (!approach->match && (approach->final_rates || !approach->plan)))) {
        fault("the final rates are given, so that there is nothing to match; use approach.final_rates: {match: ...}");
      } else if (angular && approach && approach->match && *approach->match != RateMatch::twist) {
        fault("the turning is not matched; use approach.final_rates: {match: twist}");
      }
    }
  }
}

}  // namespace grapnel
