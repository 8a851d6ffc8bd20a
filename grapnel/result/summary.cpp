#include "grapnel/result/summary.hpp"

#include <algorithm>
#include <cmath>

#include "grapnel/result/json_text.hpp"
#include "grapnel/result/load_table.hpp"
#include "grapnel/result/verdicts.hpp"

namespace grapnel {
namespace {

using Json = nlohmann::ordered_json;

constexpr const char* kSchema = "grapnel-summary/2";

Json to_json(const Vector3d& v) { return Json::array({v[0], v[1], v[2]}); }
Json to_json(const Quaterniond& q) { return Json::array({q.w, q.x, q.y, q.z}); }

// What list() below needs to know.
Json to_json(const EndEffectorMotion& end_effector);
Json to_json(const GraspImpulse& grasp);
Json to_json(const JointImpulse& joint);
Json to_json(const AsPublished::Grasp& grasp);
Json to_json(const BodyMotion& body);
Json to_json(const PhaseCost& cost);
Json to_json(const GripOutcome& grip);
Json to_json(const BrakeGrip& grip);
Json to_json(const LeastClearance& least);
Json to_json(const ClearanceEvent& event);
Json to_json(const GradedViolation& violation);
Json to_json(const LimitEvent& event);
Json to_json(const PlannedMiss& miss);
Json to_json(const ImpactReport& impact);
Json to_json(const HeldJoint& held);
Json to_json(const LoadMargin& margin);
Json to_json(const SpeedLimit& limit);
Json to_json(const EndEffectorMeasure& measure);
Json to_json(const ImpactSensitivity& sensitivity);
Json to_json(const LoopGap& loop);
Json to_json(const BodyImpulse& body);
Json to_json(const LoopReport& loops);
Json to_json(const GripLoad& load);
Json to_json(const PeakLoad& load);
Json to_json(const ReleaseReport& release);

template <class T>
Json list(const std::vector<T>& items) {
  Json array = Json::array();
  for (const T& item : items) array.push_back(to_json(item));
  return array;
}

Json to_json(const BodyMotion& body) {
  return {{"name", body.name},
          {"position", to_json(body.position)},
          {"quaternion_wxyz", to_json(body.quaternion_wxyz)},
          {"angular_velocity", to_json(body.angular_velocity)},
          {"velocity", to_json(body.velocity)}};
}

Json to_json(const JointMotion& joints) {
  return {{"names", joints.names}, {"position", joints.position}, {"velocity", joints.velocity}};
}

Json to_json(const EndEffectorMotion& end_effector) {
  Json json = {{"name", end_effector.name},
               {"position", to_json(end_effector.position)},
               {"velocity", to_json(end_effector.velocity)},
               {"angular_velocity", to_json(end_effector.angular_velocity)}};
  if (end_effector.target.empty()) return json;  // grips nothing: there is nothing to be relative to
  json["target"] = end_effector.target;
  json["grasp_point"] = end_effector.grasp_point;
  json["miss_distance"] = end_effector.miss_distance;
  json["relative_velocity"] = to_json(end_effector.relative_velocity);
  json["relative_angular_velocity"] = to_json(end_effector.relative_angular_velocity);
  return json;
}

Json to_json(const PhaseEnd& end) {
  return {{"time", end.time},
          {"base", to_json(end.base)},
          {"joints", to_json(end.joints)},
          {"end_effectors", list(end.end_effectors)},
          {"targets", list(end.targets)}};
}

Json to_json(const ContactRebound& rebound) {
  return {{"normal", to_json(rebound.normal)},
          {"normal_impulse", rebound.normal_impulse},
          {"tangential_impulse", to_json(rebound.tangential_impulse)},
          {"compression", rebound.compression},
          {"normal_work", rebound.normal_work},
          {"friction_work", rebound.friction_work},
          {"modes", rebound.modes},
          {"spread", rebound.spread}};
}

Json to_json(const ForceProfile& profile) {
  return {{"peak_force", profile.peak_force},
          {"peak_force_time", profile.peak_force_time},
          {"peak_moment", profile.peak_moment},
          {"peak_moment_time", profile.peak_moment_time},
          {"largest_deformation", profile.largest_deformation},
          {"duration", profile.duration},
          {"energy_lost", profile.energy_lost},
          {"touches", profile.touches}};
}

Json to_json(const HeldJoint& held) {
  return {{"joint", held.joint},         {"impulse", held.impulse},       {"work", held.work},
          {"told_rate", held.told_rate}, {"rate_after", held.rate_after}, {"gave_way", held.gave_way}};
}

Json to_json(const LoadMargin& margin) {
  return {{"of", margin.of},
          {"quantity", margin.quantity},
          {"load", margin.load},
          {"rating", margin.rating},
          {"margin", margin.margin()}};
}

Json to_json(const SpeedLimit& limit) {
  return {{"end_effector", limit.end_effector},
          {"factor", limit.factor},
          {"largest_speed", limit.largest_speed},
          {"of", limit.of},
          {"quantity", limit.quantity}};
}

Json to_json(const CompliantReport& compliant) {
  return {{"end", compliant.end},
          {"duration", compliant.duration},
          {"energy_lost", compliant.energy_lost},
          {"elastic_energy_after", compliant.elastic_energy_after},
          {"residual_impulse", compliant.residual_impulse},
          {"energy_residual", compliant.energy_residual},
          {"rhs_evaluations", compliant.rhs_evaluations}};
}

Json to_json(const GraspImpulse& grasp) {
  Json json = {{"end_effector", grasp.end_effector},
               {"target", grasp.target},
               {"grasp_point", grasp.grasp_point},
               {"model", grasp.model},
               {"contact_point", to_json(grasp.contact_point)},
               {"gap", grasp.gap},
               {"gap_angle", grasp.gap_angle},
               {"target_displacement", to_json(grasp.target_displacement)},
               {"impulse", to_json(grasp.impulse)},
               {"angular_impulse", to_json(grasp.angular_impulse)},
               {"impulse_magnitude", grasp.impulse_magnitude},
               {"mean_force", grasp.mean_force},
               {"determined", grasp.determined},
               {"relative_velocity_before", to_json(grasp.relative_velocity_before)},
               {"relative_angular_velocity_before", to_json(grasp.relative_angular_velocity_before)},
               {"relative_velocity_after", to_json(grasp.relative_velocity_after)},
               {"relative_angular_velocity_after", to_json(grasp.relative_angular_velocity_after)}};
  if (grasp.rebound) json["rebound"] = to_json(*grasp.rebound);
  if (grasp.profile) json["profile"] = to_json(*grasp.profile);
  return json;
}

Json to_json(const JointImpulse& joint) {
  return {{"joint", joint.joint},
          {"body", joint.body},
          {"impulse", to_json(joint.impulse)},
          {"angular_impulse", to_json(joint.angular_impulse)},
          {"along_axis", joint.along_axis},
          {"peak_force", joint.peak_force},
          {"peak_moment", joint.peak_moment},
          {"peak_driving", joint.peak_driving}};
}

Json to_json(const AsPublished::Grasp& grasp) {
  return {{"end_effector", grasp.end_effector},
          {"impulse", to_json(grasp.impulse)},
          {"angular_impulse", to_json(grasp.angular_impulse)},
          {"impulse_magnitude", grasp.impulse_magnitude}};
}

Json to_json(const AsPublished& published) {
  return {{"grasps", list(published.grasps)},
          {"joint_velocity_after", published.joint_velocity_after},
          {"linear_momentum_error", published.linear_momentum_error},
          {"angular_momentum_error", published.angular_momentum_error},
          {"relative_linear_momentum_error", published.relative_linear_momentum_error},
          {"relative_angular_momentum_error", published.relative_angular_momentum_error}};
}

Json to_json(const BrakeReport& brake) {
  return {{"joints", brake.joints},
          {"impulse", brake.impulse},
          {"kinetic_energy_before", brake.kinetic_energy_before},
          {"kinetic_energy_after", brake.kinetic_energy_after},
          {"grasps", list(brake.grasps)},
          {"base_velocity_change", to_json(brake.base_velocity_change)},
          {"base_angular_velocity_change", to_json(brake.base_angular_velocity_change)}};
}

Json to_json(const LoopGap& loop) {
  return {{"target", loop.target},
          {"end_effectors", loop.end_effectors},
          {"grasp_points", loop.grasp_points},
          {"end_effector_distance", loop.end_effector_distance},
          {"grasp_point_distance", loop.grasp_point_distance},
          {"gap", loop.gap()}};
}

Json to_json(const BodyImpulse& body) {
  return {{"body", body.body}, {"impulse", to_json(body.impulse)}, {"angular_impulse", to_json(body.angular_impulse)}};
}

/// Impulses at the grasps of an impact: each has vectors per grip, in the order of the impact's grasps.
Json impulse_sets(const ImpactReport& impact, const std::vector<SelfStress>& sets) {
  Json out = Json::array();
  for (const SelfStress& set : sets) {
    Json grasps = Json::array();
    const std::size_t grips = std::min({impact.grasps.size(), set.impulse.size(), set.angular_impulse.size()});
    for (std::size_t i = 0; i < grips; ++i) {
      grasps.push_back({{"end_effector", impact.grasps[i].end_effector},
                        {"impulse", to_json(set.impulse[i])},
                        {"angular_impulse", to_json(set.angular_impulse[i])}});
    }
    out.push_back({{"grasps", std::move(grasps)}});
  }
  return out;
}

Json vectors(const std::vector<Vector3d>& values) {
  Json out = Json::array();
  for (const Vector3d& v : values) out.push_back(to_json(v));
  return out;
}

// Six rows of six.
Json matrix6(const std::vector<double>& values) {
  Json rows = Json::array();
  for (std::size_t i = 0; i + 6 <= values.size(); i += 6) {
    const auto first = values.begin() + static_cast<std::ptrdiff_t>(i);
    rows.push_back(std::vector<double>(first, first + 6));
  }
  return rows;
}

Json to_json(const EndEffectorMeasure& measure) {
  return {{"end_effector", measure.end_effector},
          {"inverse_inertia", matrix6(measure.inverse_inertia)},
          {"pair_inverse_inertia", matrix6(measure.pair_inverse_inertia)},
          {"linear_axes", vectors(measure.linear_axes)},
          {"linear_mass", measure.linear_mass},
          {"angular_axes", vectors(measure.angular_axes)},
          {"angular_inertia", measure.angular_inertia},
          {"impulse_index", measure.impulse_index},
          {"robot_effective_mass", measure.robot_effective_mass},
          {"pair_effective_mass", measure.pair_effective_mass},
          {"miss_of_robot_com", measure.miss_of_robot_com},
          {"miss_of_system_com", measure.miss_of_system_com}};
}

Json measures_json(const ImpactReport& impact) {
  const ImpactMeasures& m = *impact.measures;
  Json response = Json::array();
  for (const std::vector<double>& grip : m.base_response) response.push_back(matrix6(grip));
  return {{"end_effectors", list(m.end_effectors)},
          {"largest_impulse", m.largest_impulse},
          {"smallest_impulse", m.smallest_impulse},
          {"coupled_index", m.coupled_index},
          {"miss_of_robot_com", m.miss_of_robot_com},
          {"miss_of_system_com", m.miss_of_system_com},
          {"base_response", std::move(response)},
          {"zero_disturbance", impulse_sets(impact, m.zero_disturbance)},
          {"zero_turning", impulse_sets(impact, m.zero_turning)}};
}

Json to_json(const ImpactSensitivity& s) {
  Json json = {{"parameter", s.parameter}, {"unit", s.unit}, {"end_effector", s.end_effector}, {"target", s.target}};
  if (!s.undefined.empty()) {
    json["undefined"] = s.undefined;
    return json;
  }
  json["impulse"] = vectors(s.impulse);
  json["angular_impulse"] = vectors(s.angular_impulse);
  json["impulse_magnitude"] = s.impulse_magnitude;
  json["base_velocity_change"] = to_json(s.base_velocity_change);
  json["base_angular_velocity_change"] = to_json(s.base_angular_velocity_change);
  return json;
}

Json to_json(const ImpactReport& impact) {
  Json json = {{"law", impact.law},
               {"time", impact.time},
               {"duration", impact.duration},
               {"grasps", list(impact.grasps)},
               {"rank", impact.rank},
               {"rows", impact.rows},
               {"null_space", impulse_sets(impact, impact.null_space)},
               {"loops", list(impact.loops)},
               {"body_impulses", list(impact.body_impulses)},
               {"kinetic_energy_before", impact.kinetic_energy_before},
               {"kinetic_energy_after", impact.kinetic_energy_after},
               {"base_velocity_change", to_json(impact.base_velocity_change)},
               {"base_angular_velocity_change", to_json(impact.base_angular_velocity_change)},
               {"joint_names", impact.joint_names},
               {"joint_velocity_change", impact.joint_velocity_change},
               {"joints", list(impact.joints)},
               {"base_reaction",
                {{"impulse", to_json(impact.base_impulse)}, {"angular_impulse", to_json(impact.base_angular_impulse)}}},
               {"targets_before", list(impact.targets_before)},
               {"targets_after", list(impact.targets_after)}};
  if (impact.as_published) {
    json["as_published"] = to_json(*impact.as_published);
  } else {
    json["as_published_absent"] = impact.as_published_absent;
  }
  json["show_as_published"] = impact.show_as_published;
  if (impact.brake) json["brake"] = to_json(*impact.brake);
  json["joints_during"] = impact.joints_during;
  json["held_joints"] = list(impact.held_joints);
  json["unique"] = impact.unique;
  json["energy_created"] = impact.energy_created;
  if (!impact.hypothesis.empty()) json["hypothesis"] = impact.hypothesis;
  if (!impact.inconsistent.empty()) json["inconsistent"] = impact.inconsistent;
  if (impact.compliant) json["compliant"] = to_json(*impact.compliant);
  if (impact.measures) json["measures"] = measures_json(impact);
  json["sensitivities"] = list(impact.sensitivities);
  json["margins"] = list(impact.margins);
  for (std::size_t i = 0; i < impact.margins.size(); ++i)
    json["margins"][i]["assumed_duration"] = rests_on_duration(impact, impact.margins[i]);
  json["speed_limits"] = list(impact.speed_limits);
  return json;
}

Json to_json(const Ledger& ledger) {
  Json json = Json::object();
  for (const LedgerEntry& entry : ledger.entries) {
    const bool unseen = !entry.not_checked.empty() && entry.pass();
    json[entry.name] = {{"value", entry.value},
                        {"bound", entry.bound},
                        {"pass", unseen ? Json(nullptr) : Json(entry.pass())},
                        {"unit", entry.unit},
                        {"note", entry.note},
                        {"applies", entry.applies},
                        {"kind", entry.kind == LedgerEntry::Kind::conservation ? "conservation" : "feasibility"}};
    if (!entry.not_checked.empty()) json[entry.name]["not_checked"] = entry.not_checked;
    if (!entry.advice.empty()) json[entry.name]["advice"] = entry.advice;
  }
  json["scale"] = {{"linear_momentum", ledger.scale.linear_momentum},
                   {"angular_momentum", ledger.scale.angular_momentum},
                   {"energy", ledger.scale.energy}};
  json["pass"] = ledger.pass();
  json["feasible"] = name_of(ledger.feasibility());
  return json;
}

Json to_json(const LoopReport& loops) {
  return {{"phase", loops.phase},
          {"closures", loops.closures},
          {"rows", loops.rows},
          {"rank", loops.rank},
          {"unprojected_position", loops.unprojected_position},
          {"unprojected_angle", loops.unprojected_angle},
          {"unprojected_velocity", loops.unprojected_velocity},
          {"unprojected_angular_velocity", loops.unprojected_angular_velocity},
          {"correction_total", loops.correction_total},
          {"integration_error", loops.integration_error}};
}

Json to_json(const GripLoad& load) {
  return {{"phase", load.phase},
          {"end_effector", load.end_effector},
          {"target", load.target},
          {"largest_force", load.largest_force},
          {"force_time", load.force_time},
          {"largest_moment", load.largest_moment},
          {"moment_time", load.moment_time},
          {"determined", load.determined}};
}

Json to_json(const PeakLoad& load) {
  const bool rated = std::isfinite(load.rating);
  return {{"of", load.of},
          {"quantity", load.quantity},
          {"phase", load.phase},
          {"peak", load.peak},
          {"time", load.time},
          {"rating", rated ? Json(load.rating) : Json()},
          {"margin", rated ? Json(load.margin()) : Json()},
          {"assumed_duration", load.assumed_duration}};
}

Json to_json(const ReleaseReport& release) {
  return {{"time", release.time}, {"end_effectors", release.end_effectors}, {"targets", release.targets}};
}

Json to_json(const PhaseCost& cost) {
  return {{"phase", cost.phase},
          {"rhs_evaluations", cost.rhs_evaluations},
          {"steps", cost.steps},
          {"rejected", cost.rejected}};
}

Json to_json(const BrakeGrip& grip) {
  return {{"end_effector", grip.end_effector},
          {"target", grip.target},
          {"impulse", to_json(grip.impulse)},
          {"angular_impulse", to_json(grip.angular_impulse)},
          {"impulse_magnitude", norm(grip.impulse)}};
}

Json to_json(const GripOutcome& grip) {
  Json json = {{"end_effector", grip.end_effector},
               {"target", grip.target},
               {"grasp_point", grip.grasp_point},
               {"captured", name_of(grip.verdict())},
               {"judged", grip.judged},
               {"reason", grip.reason},
               {"limiting", grip.limiting},
               {"distance", grip.distance},
               {"angle", grip.angle},
               {"velocity", grip.velocity},
               {"angular_velocity", grip.angular_velocity},
               {"time", grip.time},
               {"target_moved", grip.target_moved}};
  if (grip.released) json["released"] = *grip.released;
  return json;
}

Json to_json(const LeastClearance& least) {
  return {{"phase", least.phase},
          {"distance", least.distance},
          {"bodies", {least.body_a, least.body_b}},
          {"points", {to_json(least.point_a), to_json(least.point_b)}},
          {"time", least.time}};
}

Json to_json(const ClearanceEvent& event) {
  Json json = {{"phase", event.phase},          {"bodies", {event.least.body_a, event.least.body_b}},
               {"begin", event.begin_time},     {"end", event.end_time},
               {"required", event.required},    {"least_distance", event.least.distance},
               {"least_time", event.least.time}};
  if (event.overlap_begin) json["overlap_begin"] = *event.overlap_begin;
  return json;
}

Json to_json(const GradedViolation& v) {
  return {{"kind", v.kind}, {"what", v.worst}, {"phase", v.phase}, {"time", v.worst_time}, {"value", v.value}};
}

// Whether a robot could do it: the first violation, the worst, the worst of each phase.
Json feasibility_json(const CaptureResult& result) {
  Json json = {{"verdict", name_of(result.ledger.feasibility())}, {"sentence", feasibility_sentence(result)}};
  if (const auto& first = result.first_violation)
    json["first"] = {{"kind", first->kind}, {"what", first->what}, {"phase", first->phase}, {"time", first->time}};
  const std::vector<GradedViolation> by_phase = worst_by_phase(violations_of(result));
  if (!by_phase.empty()) {
    json["worst"] = to_json(*std::min_element(by_phase.begin(), by_phase.end(), is_worse));
    json["by_phase"] = list(by_phase);
  }
  json["not_checked"] = not_checked_texts(result.ledger);
  if (result.valid_until) json["valid_until"] = *result.valid_until;
  return json;
}

Json to_json(const LimitEvent& event) {
  return {{"kind", limit_kind_name(event.kind)}, {"joint", event.joint},          {"phase", event.phase},
          {"begin", event.begin_time},           {"end", event.end_time},         {"limit", event.limit},
          {"worst_value", event.worst_value},    {"worst_time", event.worst_time}};
}

Json to_json(const PlannedMiss& miss) {
  return {{"end_effector", miss.end_effector}, {"distance", miss.distance}, {"angle", miss.angle}};
}

Json to_json(const StraightInReport& in) {
  return {{"begin", in.begin},
          {"stand_off", in.stand_off},
          {"final_speed", in.final_speed},
          {"smallest_singular_value", in.smallest_singular_value},
          {"damped", in.damped},
          {"damped_interval", {in.damped_begin, in.damped_end}},
          {"unmet", in.unmet},
          {"unmet_time", in.unmet_time},
          {"fit_error", in.fit_error}};
}

Json to_json(const PlanReport& plan) {
  Json json = {{"joints", plan.joints},
               {"final_position", plan.final_position},
               {"final_rates", plan.final_rates},
               {"unmet_rate", plan.unmet_rate},
               {"rhs_evaluations", plan.rhs_evaluations}};
  if (plan.searched) {
    json["found"] = plan.found;
    json["measure"] = plan.measure;
    json["measure_value"] = plan.measure_value;
    json["miss"] = list(plan.miss);
    json["starts"] = plan.starts;
    json["solutions"] = plan.solutions;
    json["iterations"] = plan.iterations;
    json["smallest_singular_value"] = plan.smallest_singular_value;
  }
  if (plan.straight_in) json["straight_in"] = to_json(*plan.straight_in);
  return json;
}

const char* name_of(CaptureStatus status) {
  switch (status) {
    case CaptureStatus::not_run:
      return "not_run";
    case CaptureStatus::completed:
      return "completed";
    case CaptureStatus::failed:
      return "failed";
  }
  return "unknown";
}

Json document(const CaptureResult& result, std::string_view version) {
  Json json;
  json["schema"] = kSchema;
  json["version"] = version;
  json["scenario"] = {{"name", result.scenario_name}, {"sha256", result.scenario_sha256}};
  json["status"] = name_of(result.status);
  json["failure"] = result.failure;
  json["warnings"] = result.warnings;
  if (result.approach_start) json["approach"]["start"] = to_json(*result.approach_start);
  if (result.approach_end) json["approach"]["end"] = to_json(*result.approach_end);
  if (result.plan) {
    json["approach"]["planned_final_rates"] = result.plan->final_rates;
    json["approach"]["plan"] = to_json(*result.plan);
  }
  if (!result.grips.empty()) {
    json["capture"] = {{"captured", name_of(result.capture_verdict())},
                       {"verdict", capture_sentence(result)},
                       {"time", result.capture_time},
                       {"grasps", list(result.grips)}};
  }
  if (result.impact) json["impact"] = to_json(*result.impact);
  if (!result.later_impacts.empty()) json["later_impacts"] = list(result.later_impacts);
  if (!result.releases.empty()) json["releases"] = list(result.releases);
  if (result.post_impact_end) json["post_impact"]["end"] = to_json(*result.post_impact_end);
  if (!result.loops.empty()) json["post_impact"]["loops"] = list(result.loops);
  if (!result.grip_loads.empty()) json["post_impact"]["grip_loads"] = list(result.grip_loads);
  if (!result.peak_loads.empty()) json["loads"] = list(result.peak_loads);
  if (const PeakLoad* worst = worst_margin(result)) json["worst_margin"] = to_json(*worst);
  if (!result.clearance.empty()) {
    const auto least = std::min_element(result.clearance.begin(), result.clearance.end(),
                                        [](const auto& a, const auto& b) { return a.distance < b.distance; });
    Json unwatched = Json::array();
    for (const auto& [a, b] : result.clearance_unwatched) unwatched.push_back({a, b});
    json["clearance"] = {{"unwatched", unwatched},
                         {"least", to_json(*least)},
                         {"phases", list(result.clearance)},
                         {"events", list(result.clearance_events)}};
  }
  json["limits"]["events"] = list(result.limit_events);
  json["feasibility"] = feasibility_json(result);
  json["ledger"] = to_json(result.ledger);
  json["cost"] = list(result.cost);
  return json;
}

}  // namespace

std::string summary_json(const CaptureResult& result, std::string_view version) {
  return json_text(document(result, version));
}

}  // namespace grapnel
