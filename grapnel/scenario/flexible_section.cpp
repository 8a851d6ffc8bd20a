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
      field<&T::density>("density", "kg/m^3", "").above(0).required(),
  });
  static constexpr Type type = structure<T>(
      "beam_material", "With a section, in place of stiffnesses and mass per length: isotropic and linear.", fields);
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
      field<&T::at>("at", "m", "Distance from the start of the beam.").at_least(0).required(),
      field<&T::mass_per_length>("mass_per_length", "kg/m", "").above(0).optional(),
      field<&T::rotary_inertia>("rotary_inertia", "kg m", "").above(0).optional(),
      field<&T::bending_stiffness_y>("bending_stiffness_y", "N m^2", "").above(0).optional(),
      field<&T::bending_stiffness_z>("bending_stiffness_z", "N m^2", "").above(0).optional(),
      field<&T::torsional_stiffness>("torsional_stiffness", "N m^2", "").above(0).optional(),
      field<&T::axial_stiffness>("axial_stiffness", "N", "").above(0).optional(),
      field<&T::section>("section", "", "").optional(),
  });
  static constexpr Type type =
      structure<T>("beam_station", "Properties of the beam at one position; the same keys as for the beam.", fields);
};

template <>
struct Described<BeamDescription> {
  using T = BeamDescription;
  static constexpr auto fields = std::to_array<Field>({
      field<&T::from>("from", "m", "Start of the beam in the link's frame; bodies before it move with its start.")
          .by_default("[0, 0, 0]"),
      field<&T::to>("to", "m", "End of the beam; bodies beyond it move with its end.").required(),
      field<&T::section_y>(
          "section_y", "",
          "Direction of the section's y axis, in the link's frame; absent: the link's y axis, or its z "
          "axis where the beam is along y.")
          .optional(),
      field<&T::mass_per_length>(
          "mass_per_length", "kg/m",
          "Mass per length; absent: the link's whole mass belongs to the beam, uniform from start to end.")
          .above(0)
          .optional(),
      field<&T::rotary_inertia>(
          "rotary_inertia", "kg m",
          "Rotary inertia of the section about the beam, per length: density times polar moment of area.")
          .at_least(0),
      field<&T::bending_stiffness_y>("bending_stiffness_y", "N m^2",
                                     "E I of bending about the section's y axis; absent: rigid.")
          .above(0)
          .optional(),
      field<&T::bending_stiffness_z>("bending_stiffness_z", "N m^2",
                                     "E I of bending about the section's z axis; absent: rigid.")
          .above(0)
          .optional(),
      field<&T::torsional_stiffness>("torsional_stiffness", "N m^2", "G J; absent: rigid.").above(0).optional(),
      field<&T::axial_stiffness>("axial_stiffness", "N", "E A; absent: rigid.").above(0).optional(),
      field<&T::material>("material", "", "").optional(),
      field<&T::section>("section", "", "Section, constant along the beam.").optional(),
      field<&T::stretches>("stretches", "", "With a section and a material: whether the beam stretches (E A)."),
      field<&T::stations>("stations", "",
                          "A beam with varying properties, from start to end: stiffnesses, masses or section "
                          "dimensions are linear between the stations.")
          .items(0, 100),
      field<&T::damping_ratio>("damping_ratio", "",
                               "Damping ratio of the first mode of each kind, of the beam alone, clamped at its start; "
                               "for higher modes it grows with the frequency.")
          .at_least(0)
          .at_most(1),
      field<&T::segments>(
          "segments", "",
          "Number of equal segments, each with springs at its two Gauss points; errors of bending fall with the fourth "
          "power of this number, of torsion and of stiffening by tension with the square.")
          .at_least(1)
          .at_most(100),
      field<&T::modes>("modes", "",
                       "Number of the slowest modes of each kind (bending about y, about z, torsion) that the beam "
                       "keeps, clamped at its start, with the bodies on the link; absent: all modes of its segments.")
          .at_least(1)
          .at_most(200)
          .optional(),
      field<&T::fastest_mode>("fastest_mode", "Hz",
                              "Upper limit of the frequencies of these modes: integration must resolve each of them.")
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
      field<&T::damping_ratio>("damping_ratio", "", "").at_least(0).at_most(1),
      field<&T::translation>("translation", "", "Participation of translation, in kg^(1/2)."),
      field<&T::rotation>("rotation", "", "Participation of rotation about the frame's origin, in kg^(1/2) m."),
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
