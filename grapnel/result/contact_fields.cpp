// The fields of summary.json that report contacts between shapes.
#include <array>

#include "grapnel/result/result_documents.hpp"

namespace grapnel {

template <>
const Type& type_of<HardContactReport>() {
  using H = HardContactReport;
  static constexpr Field fields[] = {
      field<&H::impacts>("impacts", "1", "number of impacts in an instant"),
      field<&H::fastest_impact>("fastest_impact", "m/s", "largest approach speed of an impact"),
      field<&H::last_time>("last_time", "s", "time of the last impact; absent: no impact"),
      field<&H::impulse>("impulse", "N s", "sum of the normal impulses of all impacts"),
      field<&H::restitution_loss>("restitution_loss", "J", "energy lost in impacts by the normal impulses"),
      field<&H::friction_loss>("friction_loss", "J", "energy lost in impacts by friction"),
      field<&H::persistent_since>("persistent_since", "s",
                                  "start of the first contact that lasted; absent: every contact was an impact"),
  };
  static constexpr Type type =
      structure<H>("HardContactReport", "instantaneous impacts of two hard bodies over the whole run.", fields);
  return type;
}

template <>
const Type& type_of<ContactPairReport>() {
  using C = ContactPairReport;
  constexpr auto pressed = [](const C& c) { return c.first_time && (!c.hard || c.peak_force > 0); };
  static constexpr Field fields[] = {
      derived<[](const C& c) {
        return std::array{c.body_a, c.body_b};
      }>("bodies", "", "pair of bodies, or of a body and an obstacle"),
      field<&C::touches>("touches", "1", "number of times that the contact began"),
      field<&C::touches_at_end>("touches_at_end", "whether the bodies touched at the end of the run"),
      field<&C::first_time>("first_time", "s", "start of the first contact; absent: no contact"),
      field<&C::duration>("duration", "s", "total time with contact"),
      field<&C::impulse>("impulse", "N s", "time integral of the normal force, with the impulses of hard contact"),
      field<&C::peak_force>("peak_force", "N", "largest normal force"),
      field<&C::peak_time>("peak_time", "s", "time of the largest normal force; absent: no contact that lasts")
          .when<pressed>(),
      field<&C::peak_point>("peak_point", "m",
                            "centre of the normal forces at that time, in W; absent: no contact that lasts")
          .when<pressed>(),
      field<&C::largest_depth>("largest_depth", "m", "largest penetration, of both surfaces together"),
      field<&C::slip_distance>("slip_distance", "m", "path of the largest slip velocity during contact"),
      field<&C::damping_loss>("damping_loss", "J", "energy dissipated by the normal forces"),
      field<&C::friction_loss>("friction_loss", "J", "energy dissipated by friction"),
      field<&C::elastic_energy>("elastic_energy", "J", "elastic energy of the surfaces at the end of the run"),
      field<&C::beyond_model>("beyond_model",
                              "whether an overlap was too deep for the contact model; then forces are not reliable"),
      field<&C::beyond_model_since>("beyond_model_since", "s",
                                    "start of the first such overlap: forces and the motion are not reliable from then "
                                    "on; absent: no overlap was too deep"),
      field<&C::beyond_model_depth>("beyond_model_depth", "m",
                                    "penetration at that time; absent: no overlap was too deep"),
      field<&C::hard>("hard", "impacts of hard contact; absent: the contact is compliant"),
  };
  static constexpr Type type = structure<C>(
      "ContactPairReport",
      "contact between two bodies over the whole run. The normal force is the sum over all places where they touch.",
      fields);
  return type;
}

template <>
const Type& type_of<StagesReport::Stage>() {
  using S = StagesReport::Stage;
  static constexpr Choice choices[] = {choice(S::approach, "approach"), choice(S::contact, "contact"),
                                       choice(S::closed, "closed"),     choice(S::caged, "caged"),
                                       choice(S::settled, "settled"),   choice(S::latched, "latched")};
  static constexpr Type type = enumeration<S>("CaptureStage", choices);
  return type;
}

template <>
const Type& type_of<StagesReport::Cage>() {
  using C = StagesReport::Cage;
  static constexpr Choice choices[] = {choice(C::not_searched, "not_searched"), choice(C::caged, "caged"),
                                       choice(C::can_leave, "can_leave"), choice(C::undecided, "undecided")};
  static constexpr Type type = enumeration<C>("CageVerdict", choices);
  return type;
}

template <>
const Type& type_of<StagesReport::Failure>() {
  using F = StagesReport::Failure;
  static constexpr Choice choices[] = {choice(F::none, "none"),
                                       choice(F::no_contact, "no_contact"),
                                       choice(F::closed_on_nothing, "closed_on_nothing"),
                                       choice(F::pushed_away, "pushed_away"),
                                       choice(F::not_settled, "not_settled"),
                                       choice(F::jammed, "jammed"),
                                       choice(F::slipped, "slipped"),
                                       choice(F::lost, "lost")};
  static constexpr Type type = enumeration<F>("StageFailure", choices);
  return type;
}

template <>
const Type& type_of<StagesReport>() {
  using S = StagesReport;
  constexpr auto searched = [](const S& s) { return s.cage_time.has_value(); };
  static constexpr Field fields[] = {
      field<&S::target>("target", "target"),
      field<&S::reached>("reached", "last stage that was reached"),
      field<&S::contact_time>("contact_time", "s", "first contact of gripper and target; absent: none"),
      field<&S::closing_time>("closing_time", "s", "start of closing; absent: it did not begin"),
      field<&S::closed_time>("closed_time", "s",
                             "end of closing, if the gripper touched the target then; absent otherwise"),
      field<&S::settled_time>("settled_time", "s",
                              "time at which the target had moved less than stated for the stated time; absent: never"),
      field<&S::latched_time>("latched_time", "s", "time at which a grasp of the target closed; absent: none"),
      field<&S::cage>("cage",
                      "last search of an escape path. `caged`: there is none. `can_leave`: one was found. `undecided`: "
                      "neither was shown"),
      field<&S::cage_time>("cage_time", "s", "time of this search"),
      field<&S::caged_time>("caged_time", "s", "time of the first search that found a cage; absent: none"),
      field<&S::cage_allowance>("cage_allowance", "m", "overlap of shapes that counted as free in the last search")
          .when<searched>(),
      field<&S::cage_poses>("cage_poses", "1", "poses evaluated in the last search").when<searched>(),
      field<&S::failure>(
          "failure",
          "`no_contact`: the gripper did not touch the target. `closed_on_nothing`: nor when it had closed. "
          "`pushed_away`: after contact the target moved away. `not_settled`: it moves near or in the gripper. "
          "`jammed`: the target is "
          "settled, but an escape path was found. `slipped`: the settled target moved again. `lost`: it lost contact"),
      field<&S::failure_time>("failure_time", "s", "time of the failure; absent: none"),
      field<&S::grip_force>(
          "grip_force", "N",
          "sum of the normal forces of the gripper on the target, at the end of the run or when a grasp closed"),
      field<&S::least_friction_margin>("least_friction_margin", "1",
                                       "smallest share of friction that was left while the target was settled, over "
                                       "the pairs of the gripper; 0: one slips; absent: not settled"),
  };
  static constexpr Type type = structure<S>("StagesReport", "stages of the capture of one target by contacts.", fields);
  return type;
}

std::optional<double> stage_time(const StagesReport& report, StagesReport::Stage stage) {
  using Stage = StagesReport::Stage;
  switch (stage) {
    case Stage::approach:
      break;
    case Stage::contact:
      return report.contact_time;
    case Stage::closed:
      return report.closed_time;
    case Stage::caged:
      return report.caged_time;
    case Stage::settled:
      return report.settled_time;
    case Stage::latched:
      return report.latched_time;
  }
  return {};
}

}  // namespace grapnel
