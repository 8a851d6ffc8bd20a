#include "grapnel/impact/impact_law.hpp"

#include <array>
#include <stdexcept>

#include "grapnel/impact/bilateral_restitution.hpp"
#include "grapnel/impact/compliant_impact.hpp"
#include "grapnel/impact/contact_impact.hpp"
#include "grapnel/impact/hard_impact.hpp"
#include "grapnel/impact/plastic_impact.hpp"
#include "grapnel/impact/published_impact.hpp"

namespace grapnel {

// ---- The laws ----

namespace {

ImpactSolution solve_plastic(const ImpactInput& input) {
  return plastic_impact(input.model, input.state, input.grasps, input.held);
}

// E of bilateral restitution, row by row: grasps that already hold do not rebound.
ImpactSolution solve_bilateral(const ImpactInput& input) {
  std::vector<std::vector<double>> E;
  for (std::size_t i = 0; i < input.grasps.size(); ++i) {
    const int count = row_count(input.grasps[i].model);
    std::vector<double> e(static_cast<std::size_t>(count), 0.0);
    for (int r = 0; r < count && i >= input.holding; ++r)
      e[r] = r < count - 3 ? input.setup.angular_restitution : input.setup.restitution;
    E.push_back(std::move(e));
  }
  return bilateral_restitution(input.model, input.state, input.grasps, E, input.held);
}

// Contacts, with grasps that already hold and transmit their impulses.
ImpactSolution solve_contacts(const ImpactInput& input, double friction) {
  std::vector<ContactPoint> points;
  for (std::size_t i = input.holding; i < input.grasps.size(); ++i) {
    const Grasp& grasp = input.grasps[i];
    points.push_back(
        {grasp.robot_body, grasp.target_body, grasp.p_WC, input.normals[i], input.setup.restitution, friction});
  }
  points.insert(points.end(), input.beside.begin(), input.beside.end());
  ContactImpactOptions options;
  if (!input.beside.empty()) options.max_steps = kMaxHardSteps;
  return contact_impact(input.model, input.state, points, input.setup.hypothesis, input.grasps.first(input.holding),
                        input.held, options);
}
ImpactSolution solve_restitution(const ImpactInput& input) { return solve_contacts(input, 0); }
ImpactSolution solve_friction(const ImpactInput& input) { return solve_contacts(input, input.setup.friction); }

// Forces in the solver's order, contacts first => forces and impulses in the input's order.
ImpactSolution solve_compliant(const ImpactInput& input) {
  std::vector<CompliantContact> contacts;
  std::vector<CompliantGrasp> grasps;
  for (std::size_t i = 0; i < input.grasps.size(); ++i) {
    const GraspComplianceSetup& g = input.setup.grasp;
    if (input.is_contact(i)) {
      contacts.push_back(compliant_contact(input.setup, input.grasps[i], input.normals[i]));
    } else {
      grasps.push_back({input.grasps[i], g.linear_stiffness, g.linear_damping, g.angular_stiffness, g.angular_damping});
    }
  }
  std::vector<int> held;
  for (const HeldRate& h : input.held) held.push_back(h.velocity);
  ImpactSolution solution = compliant_impact(input.model, input.state, contacts, grasps, input.setup.compliant, held,
                                             input.each_step, input.drive, input.shapes, input.loops);
  std::vector<ForceHistory> forces;
  for (std::size_t i = 0, contact = 0, grasp = contacts.size(); i < input.grasps.size(); ++i) {
    forces.push_back(std::move(solution.forces[input.is_contact(i) ? contact++ : grasp++]));
    solution.contacts.push_back({forces.back().impulse, std::vector<bool>(6, true)});
  }
  solution.forces = std::move(forces);
  return solution;
}

ImpactSolution solve_published(const ImpactInput& input) {
  ImpactSolution solution = published_impact(input.model, input.state, input.root, input.grasps);
  if (!solution.message.empty()) solution.message = "the published formulas are not defined: " + solution.message;
  return solution;
}

using Law = ImpactSetup::Law;

// In the order of the values. Columns: of grasps, of contacts, in time, separates, differentiable, published.
// clang-format off
constexpr auto kImpactLaws = std::to_array<ImpactLaw>({
    {Law::plastic,               "plastic",               1, 0, 0, 0, 1, 0, solve_plastic, {"joints"}},
    {Law::bilateral_restitution, "bilateral_restitution", 1, 0, 0, 1, 0, 0, solve_bilateral, {"restitution", "joints"}},
    {Law::restitution,           "restitution",           0, 1, 0, 0, 0, 0, solve_restitution,
        {"restitution", "hypothesis", "joints"}},
    {Law::friction,              "friction",              0, 1, 0, 0, 0, 0, solve_friction,
        {"restitution", "hypothesis", "friction", "joints"}},
    {Law::compliant,             "compliant",             1, 1, 1, 0, 0, 0, solve_compliant,
        {"friction", "contact", "grasp", "longest", "settled", "joints"}},
    {Law::as_published,          "as_published",          1, 0, 0, 0, 0, 1, solve_published, {}},
});
// clang-format on

}  // namespace

std::span<const ImpactLaw> impact_laws() { return kImpactLaws; }

const ImpactLaw& impact_law(Law law) { return kImpactLaws.at(static_cast<std::size_t>(law)); }

CompliantContact compliant_contact(const ImpactSetup& setup, const Grasp& grasp, const Vector3d& n_W) {
  const ContactComplianceSetup& c = setup.contact;
  return {grasp.robot_body, grasp.target_body, grasp.p_WC,     n_W,         c.model, c.stiffness,
          c.damping,        c.exponent,        setup.friction, c.slip_speed};
}

// ---- Their keys in "impact" ----

template <>
const Type& type_of<Law>() {
  static constexpr auto choices = [] {
    std::array<Choice, kImpactLaws.size()> named{};
    for (std::size_t i = 0; i < named.size(); ++i)
      named[i] = {static_cast<std::int64_t>(kImpactLaws[i].law), kImpactLaws[i].name, {}};
    return named;
  }();
  static constexpr Type type = enumeration<Law>("Law", choices);
  return type;
}

template <>
const Type& type_of<ContactComplianceSetup>() {
  using T = ContactComplianceSetup;
  static constexpr auto fields = std::to_array<Field>({
      field<&T::model>("model", "", "kelvin_voigt: k d + c d'. hertz: k d^1.5. hunt_crossley: k d^n (1 + a d')."),
      field<&T::stiffness>("stiffness", "N/m, N/m^1.5 or N/m^n", "k.").above(0).required(),
      field<&T::damping>("damping", "N s/m, or s/m", "c; for hunt_crossley a.").at_least(0),
      field<&T::exponent>("exponent", "", "n of hunt_crossley.").at_least(1).at_most(5),
      field<&T::slip_speed>("slip_speed", "m/s", "Slip speed below which Coulomb's friction is regularized.").above(0),
  });
  static constexpr Type type = structure<T>("contact_compliance",
                                            "Law compliant: normal force of contacts over the deformation d and its "
                                            "rate d'; never negative. Required with contacts.",
                                            fields);
  return type;
}

template <>
struct Described<GraspComplianceSetup> {
  using T = GraspComplianceSetup;
  static constexpr auto fields = std::to_array<Field>({
      field<&T::linear_stiffness>("linear_stiffness", "N/m", "Stiffness against displacement.").above(0).required(),
      field<&T::linear_damping>("linear_damping", "N s/m", "Damping of displacement.").at_least(0),
      field<&T::angular_stiffness>("angular_stiffness", "N m/rad",
                                   "Stiffness against rotation; required for grasps with model rigid and hinge.")
          .above(0)
          .optional(),
      field<&T::angular_damping>("angular_damping", "N m s/rad", "Damping of rotation.").at_least(0),
  });
  static constexpr Type type = structure<T>("grasp_compliance",
                                            "Law compliant: a spring and a damper of grasps in every held direction, "
                                            "unstressed at closing. Required with grasps.",
                                            fields);
};

template <>
const Type& type_of<ImpactSetup>() {
  using T = ImpactSetup;
  static constexpr auto fields = std::to_array<Field>({
      field<&T::law>(
          "law", "",
          "plastic: grasps; the grasped points move together afterwards. bilateral_restitution: grasps reverse the "
          "relative velocity, u+ = -E u-, and do not hold. restitution: contacts, without friction. friction: "
          "contacts, with Coulomb friction. compliant: grasps and contacts as a compliant impact. as_published: the "
          "thesis's (3.9)-(3.13), for comparison: momentum is not conserved."),
      field<&T::duration>("duration", "s",
                          "Duration for mean forces; without effect on the motion, except with `modes: slow`.")
          .above(0),
      field<&T::joints>(
          "joints", "",
          "The robot's joints during the impact. free: not driven (rotors count by their inertia). braked: at rest "
          "from its first instant on. driven: they keep their rates, as with infinitely heavy rotors, as far as the "
          "grasps allow; else the drives are overpowered by the minimum amount. impedance: by the law of `impedance`; "
          "law compliant only. Not with law as_published. Absent: free.")
          .optional(),
      field<&T::modes>("modes", "",
                       "Flexible modes of links, gears and hinges that respond to the impact. all: every one. none: no "
                       "mode; deflections keep their rates. slow: the modes whose period is longer than `duration` "
                       "respond, the others keep their rates. Not with law compliant. With law plastic the impulse "
                       "depends on it, and impact.by_modes of the summary shows the dependence."),
      field<&T::restitution>("restitution", "",
                             "e. For contacts one number; for bilateral_restitution one for all rows, or one for the "
                             "linear and one for the angular rows. Absent: 0.")
          .at_least(0)
          .at_most(1)
          .as("restitution")
          .optional(),
      field<&T::hypothesis>(
          "hypothesis", "",
          "Meaning of e for a contact. stronge: e^2 is the ratio of the works of the normal force in restitution and "
          "compression. poisson: e is the ratio of its impulses. newton: e is the ratio of the normal velocities; with "
          "friction this can create energy, which the result reports. Absent: stronge.")
          .optional(),
      field<&T::friction>("friction", "", "Coulomb's coefficient; laws friction and compliant. Absent: 0.")
          .at_least(0)
          .optional(),
      field<&T::contact>("contact", "", "").optional(),
      field<&T::grasp>("grasp", "", "").optional(),
      found<[](T& t) -> double& { return t.compliant.longest; }>(
          "longest", "s",
          "Law compliant: maximum duration of the impact. An unfinished impact is cut off with a warning, and an "
          "instantaneous impulse stops the remaining relative motion of a grasp. Absent: 1.")
          .above(0)
          .optional(),
      found<[](T& t) -> double& { return t.compliant.settled; }>(
          "settled", "",
          "Law compliant: grasps are at rest when this fraction of the energy of their relative motion remains. They "
          "are rigid from then on; the remainder is removed instantaneously. Absent: 1e-8.")
          .above(0)
          .at_most(0.1)
          .optional(),
  });
  static constexpr Type type = structure<T>("impact", "What happens when grasps close.", fields);
  return type;
}

}  // namespace grapnel
