#include <array>

#include "grapnel/scenario/sections.hpp"

namespace grapnel {

// ---- What robot files hold about flexible links ----

template <>
struct Described<BeamMaterial> {
  using T = BeamMaterial;
  static constexpr auto fields = std::to_array<Field>({
      field<&T::young_modulus>("young_modulus", "Pa", "E.").above(0).required(),
      field<&T::shear_modulus>("shear_modulus", "Pa", "G.").above(0).required(),
      field<&T::density>("density", "kg/m^3", "Density.").above(0).required(),
  });
  static constexpr Type type = structure<T>(
      "beam_material",
      "With a section, in place of mass per length, rotary inertia and the four stiffnesses: isotropic and linear.",
      fields);
};

template <>
struct Described<BeamSection> {
  using T = BeamSection;
  static constexpr auto fields = std::to_array<Field>({
      field<&T::diameter>("diameter", "m", "Outer diameter of a round section.").above(0).optional(),
      field<&T::width>("width", "m", "Outer width of a rectangle, along the section's y axis.").above(0).optional(),
      field<&T::height>("height", "m", "Outer height of a rectangle, along the section's z axis.").above(0).optional(),
      field<&T::wall_thickness>("wall_thickness", "m", "Wall thickness; absent: solid.").above(0).optional(),
  });
  static constexpr auto rules = std::to_array<Rule>({not_empty()});
  static constexpr Type type =
      structure<T>("beam_section", "A circle or a rectangle, solid or hollow; with a material.", fields, rules);
};

template <>
struct Described<BeamStation> {
  using T = BeamStation;
  static constexpr auto fields = std::to_array<Field>({
      field<&T::at>("at", "m", "Distance from the beam's beginning: 0 at the first, the beam's length at the last.")
          .at_least(0)
          .required(),
      field<&T::mass_per_length>(
          "mass_per_length", "kg/m",
          "As of the beam. Every station states it, or none; the same holds for the next five keys.")
          .above(0)
          .optional(),
      field<&T::rotary_inertia>("rotary_inertia", "kg m", "As of the beam.").above(0).optional(),
      field<&T::bending_stiffness_y>("bending_stiffness_y", "N m^2", "As of the beam.").above(0).optional(),
      field<&T::bending_stiffness_z>("bending_stiffness_z", "N m^2", "As of the beam.").above(0).optional(),
      field<&T::torsional_stiffness>("torsional_stiffness", "N m^2", "As of the beam.").above(0).optional(),
      field<&T::axial_stiffness>("axial_stiffness", "N", "As of the beam.").above(0).optional(),
      field<&T::section>("section", "",
                         "As of the beam: every station has one, of one kind (round or rectangular, solid or hollow).")
          .optional(),
  });
  static constexpr Type type =
      structure<T>("beam_station", "Properties of the beam at one position; the same keys as for the beam.", fields);
};

template <>
struct Described<BeamDescription> {
  using T = BeamDescription;
  static constexpr auto fields = std::to_array<Field>({
      field<&T::from>("from", "m",
                      "Beginning of the beam, in the link's frame. The part before it moves with the beginning.")
          .by_default("[0, 0, 0]"),
      field<&T::to>("to", "m",
                    "End of the beam. The part beyond it (child links, end-effectors, shapes) moves with the end.")
          .required(),
      field<&T::section_y>("section_y", "",
                           "Direction of the section's principal axis y, in the link's frame; its component along the "
                           "beam is ignored. x is along the beam, from `from` to `to`, and z completes the "
                           "right-handed system. Absent: the link's y axis; its z axis where the beam is along y.")
          .optional(),
      field<&T::mass_per_length>("mass_per_length", "kg/m",
                                 "Mass per length of the beam. Absent: the link's mass over the beam's length.")
          .above(0)
          .optional(),
      field<&T::rotary_inertia>(
          "rotary_inertia", "kg m",
          "Rotary inertia of the section about the beam, per length: density times polar moment of area.")
          .at_least(0),
      field<&T::bending_stiffness_y>("bending_stiffness_y", "N m^2",
                                     "E I of bending about the section's y axis, in which points of the beam move "
                                     "along z. Absent: does not bend about y.")
          .above(0)
          .optional(),
      field<&T::bending_stiffness_z>("bending_stiffness_z", "N m^2",
                                     "E I of bending about the section's z axis. Absent: does not bend about z.")
          .above(0)
          .optional(),
      field<&T::torsional_stiffness>("torsional_stiffness", "N m^2",
                                     "G J. Needs inertia about the beam: rotary_inertia, or the link's inertia about a "
                                     "beam that has the link's whole mass. Absent: does not twist.")
          .above(0)
          .optional(),
      field<&T::axial_stiffness>("axial_stiffness", "N", "E A. Absent: does not stretch.").above(0).optional(),
      field<&T::material>("material", "", "").optional(),
      field<&T::section>("section", "", "A circle or a rectangle, constant along the beam; with a `material`.")
          .optional(),
      field<&T::stretches>("stretches", "",
                           "With a section and a material: whether the beam also stretches, with E A. Its axial modes "
                           "are fast; `modes` and fastest_mode limit them."),
      field<&T::stations>("stations", "",
                          "A non-uniform beam: positions from its beginning to its end. Their values, numbers or sizes "
                          "of sections, are linear between them and are not stated by the beam.")
          .items(0, 100),
      field<&T::damping_ratio>("damping_ratio", "",
                               "Damping ratio of the first mode of each kind (bending about y, bending about z, "
                               "stretching, twisting) of the beam alone, clamped at its beginning. Damping is "
                               "proportional to stiffness: for other modes the ratio grows with the frequency.")
          .at_least(0)
          .at_most(1),
      field<&T::segments>("segments", "",
                          "Number of equal lengths, each with springs at its two Gauss points. Errors of bending fall "
                          "with its fourth power, errors of twisting and of the stiffening by tension with the square. "
                          "The fastest frequency, and with it the computation time, grows unless `modes` limits it.")
          .at_least(1)
          .at_most(100),
      field<&T::modes>(
          "modes", "",
          "Number of retained modes of each kind (bending about y, bending about z, stretching, twisting), the slowest "
          "ones. They are those of the link clamped at its beginning, with its load (without a captured target) and "
          "all joints at zero. At most 2 `segments`. Absent: all that the segments have.")
          .at_least(1)
          .at_most(200)
          .optional(),
      field<&T::fastest_mode>("fastest_mode", "Hz",
                              "Maximum frequency of the retained modes: integration steps must resolve every one.")
          .above(0),
  });
  static constexpr Type type =
      structure<T>("beam",
                   "The link is flexible along a straight beam, modelled as rigid segments on springs. The link's "
                   "mass, centre of mass and inertia describe the whole undeformed link and include the beam, a "
                   "slender rod; bodies beside the beam move with its ends.",
                   fields);
};

template <>
struct Described<VibrationMode> {
  using T = VibrationMode;
  static constexpr auto fields = std::to_array<Field>({
      field<&T::frequency>("frequency", "", "Frequency, clamped at the frame, in Hz.").above(0).required(),
      field<&T::damping_ratio>("damping_ratio", "", "Damping ratio of the mode.").at_least(0).at_most(1),
      field<&T::translation>("translation", "",
                             "Participation of translation, in kg^(1/2): the momentum per rate of the mode's "
                             "coordinate. Its square is the effective mass."),
      field<&T::rotation>(
          "rotation", "",
          "Participation of rotation about the frame's origin, in kg^(1/2) m: the angular momentum per rate."),
  });
  static constexpr Type type = structure<T>(
      "vibration_mode",
      "A mode of the body clamped at its frame, of unit modal mass: the momentum per rate of its coordinate. The "
      "square of its translation is its effective mass. The body's mass and inertia include it.",
      fields);
};

template <>
const Type& type_of<BeamDescription>() {
  return Described<BeamDescription>::type;
}
template <>
const Type& type_of<VibrationMode>() {
  return Described<VibrationMode>::type;
}

const Type& beam_description() { return type_of<std::optional<BeamDescription>>(); }
const Type& vibrations_description() { return type_of<std::vector<VibrationMode>>(); }

}  // namespace grapnel
