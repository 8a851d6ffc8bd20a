#include "grapnel/scenario/sections.hpp"

namespace grapnel {

// ---- What "control" holds ----

template <>
struct Described<ControlSetup> {
  using T = ControlSetup;
  static constexpr auto fields = std::to_array<Field>({
      found<[](T& t) -> double& { return t.timing.period; }>(
          "period", "s", "Between samples: sensors are read at t = 0 and every period after it, in all phases.")
          .above(0)
          .required(),
      found<[](T& t) -> double& { return t.timing.delay; }>(
          "delay", "s", "From a sample to the command that follows from it, which is then held until the next acts.")
          .at_least(0),
      field<&T::plugin>("plugin", "",
                        "A controller of one's own: the path of a shared library, relative to this file. It drives the "
                        "joints where approach.tracking.mode or post_impact.joints is controller.")
          .optional(),
      field<&T::parameters>("parameters", "",
                            "What the plugin is given when it is made: a mapping that it understands.")
          .as("parameters")
          .optional(),
      field<&T::base_torque>("base_torque", "",
                             "Whether the plugin says a torque on the base too, wherever it drives the joints."),
  });
  static constexpr auto rules = std::to_array<Rule>({
      needs("parameters", "plugin"),
      needs("base_torque", "plugin"),
  });
  static constexpr Type type = structure<T>("control",
                                            "The on-board computer: laws of joints and of the base speak at the ticks "
                                            "of one clock, and what they say is held. "
                                            "Absent: they act continuously.",
                                            fields, rules);
};

const Type& control_description() { return type_of<std::optional<ControlSetup>>(); }

}  // namespace grapnel
