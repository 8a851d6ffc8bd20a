#include "grapnel/scenario/sections.hpp"
#include "grapnel/text/yaml_values.hpp"

namespace grapnel {

// ---- Content of "stages" ----

template <>
struct Described<CageSearchSetup> {
  using T = CageSearchSetup;
  static constexpr auto fields = std::to_array<Field>({
      field<&T::resolution>(
          "resolution", "m",
          "Smallest displacement that the search distinguishes; overlaps of up to twice this count as "
          "free. Absent: a hundredth of the radius of the target's shapes, or a tenth of the smallest half thickness "
          "of a shape if that is less.")
          .above(0)
          .optional(),
      field<&T::poses>("poses", "", "Largest number of evaluated poses of one search.")
          .at_least(100)
          .at_most(10'000'000),
  });
  static constexpr Type type = structure<T>(
      "cage", "Search of an escape path from the gripper, at the end of closing and when the target is settled.",
      fields);
};

namespace {

struct SettledKeys;

}  // namespace

template <>
struct Described<SettledKeys> {
  using T = StagesSetup;
  static constexpr auto fields = std::to_array<Field>({
      field<&T::speed>("speed", "m/s", "Largest speed of the target's centre of mass relative to `relative_to`.")
          .above(0)
          .required(),
      field<&T::rate>("rate", "rad/s", "Largest angular rate of the target relative to `relative_to`.")
          .above(0)
          .required(),
      field<&T::time>("for", "s", "Time for which neither is exceeded.").above(0).required(),
  });
  static constexpr Type type = structure<T>(
      "settled", "The target is settled once the gripper touches it and it has moved less than this for a time.",
      fields);
};

template <>
struct Described<StagesSetup> {
  using T = StagesSetup;
  static constexpr auto fields = std::to_array<Field>({
      field<&T::target>("target", "", "Target. Absent: the only one.").optional(),
      field<&T::gripper>("gripper", "",
                         "Links of the gripper. Absent: all links that may touch the target by `contacts`.")
          .items(1, 1000)
          .optional(),
      field<&T::closing>(
          "closing", "",
          "Name of the phase of motion in which the gripper closes; closing ends with its `move`, or with "
          "the phase. Absent: the first phase.")
          .optional(),
      field<&T::relative_to>("relative_to", "", "Link to which the target's motion is relative. Absent: the base.")
          .optional(),
      group<T, SettledKeys>("settled", "").required(),
      field<&T::away>(
          "away", "m",
          "Distance between gripper and target beyond which a touched target counts as pushed away. Absent: "
          "the radius of the target's shapes about its frame.")
          .above(0)
          .optional(),
      field<&T::cage>("cage", "", "").optional(),
  });
  static constexpr Type type = structure<T>(
      "stages", "Stages of the capture of one target: first contact, closing, caged, settled, latched.", fields);
};

const Type& stages_description() { return type_of<std::vector<StagesSetup>>(); }

// ---- Reading ----

void finish_stages(Reading& reading) {
  const Node& list = part(reading.root, "stages");
  for (std::size_t i = 0; i < reading.problem.stages.size() && !reading.faults.full(); ++i) {
    const Node& node = list.is_sequence() ? list.items[i] : list;
    const std::string path = list.is_sequence() ? item("stages", i) : "stages";
    const StagesSetup& stages = reading.problem.stages[i];
    if (!stages.target.empty())
      reading.targets.expect(stages.target, part(node, "target").mark, below(path, "target"), reading.faults);
    if (!stages.relative_to.empty())
      reading.robot.links.expect(stages.relative_to, part(node, "relative_to").mark, below(path, "relative_to"),
                                 reading.faults);
    const Node& gripper = part(node, "gripper");
    for (std::size_t k = 0; k < stages.gripper.size() && k < gripper.items.size(); ++k)
      reading.robot.links.expect(stages.gripper[k], gripper.items[k].mark, item(below(path, "gripper"), k),
                                 reading.faults);
  }
}

}  // namespace grapnel
