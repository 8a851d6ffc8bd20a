// The fields of summary.json that report contacts between shapes.
#include <array>

#include "grapnel/result/result_documents.hpp"

namespace grapnel {

template <>
const Type& type_of<ContactPairReport>() {
  using C = ContactPairReport;
  constexpr auto touched = [](const C& c) { return c.first_time.has_value(); };
  static constexpr Field fields[] = {
      derived<[](const C& c) {
        return std::array{c.body_a, c.body_b};
      }>("bodies", "", "pair of bodies, or of a body and an obstacle"),
      field<&C::touches>("touches", "1", "number of times that the contact began"),
      field<&C::touches_at_end>("touches_at_end", "whether the bodies touched at the end of the run"),
      field<&C::first_time>("first_time", "s", "start of the first contact; absent: no contact"),
      field<&C::duration>("duration", "s", "total time with contact"),
      field<&C::impulse>("impulse", "N s", "time integral of the normal force"),
      field<&C::peak_force>("peak_force", "N", "largest normal force"),
      field<&C::peak_time>("peak_time", "s", "time of the largest normal force; absent: no contact").when<touched>(),
      field<&C::peak_point>("peak_point", "m", "centre of the normal forces at that time, in W; absent: no contact")
          .when<touched>(),
      field<&C::largest_depth>("largest_depth", "m", "largest penetration, of both surfaces together"),
      field<&C::slip_distance>("slip_distance", "m", "path of the largest slip velocity during contact"),
      field<&C::damping_loss>("damping_loss", "J", "energy dissipated by the normal forces"),
      field<&C::friction_loss>("friction_loss", "J", "energy dissipated by friction"),
      field<&C::elastic_energy>("elastic_energy", "J", "elastic energy of the surfaces at the end of the run"),
      field<&C::beyond_model>("beyond_model",
                              "whether an overlap was too deep for the contact model; then forces are not reliable"),
  };
  static constexpr Type type = structure<C>(
      "ContactPairReport",
      "contact between two bodies over the whole run. The normal force is the sum over all places where they touch.",
      fields);
  return type;
}

}  // namespace grapnel
