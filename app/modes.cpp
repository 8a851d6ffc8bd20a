// grapnel modes: converts matrices of a finite-element model to the modes of vibration of a link or a panel.
#include <fmt/format.h>

#include <array>
#include <cmath>
#include <optional>
#include <string_view>

#include "commands.hpp"
#include "grapnel/campaign/result_folder.hpp"
#include "grapnel/import/component_modes.hpp"
#include "grapnel/result/atomic_file.hpp"
#include "grapnel/text/error_text.hpp"
#include "grapnel/text/message_text.hpp"
#include "grapnel/text/write_yaml.hpp"
#include "grapnel/text/yaml_values.hpp"
#include "terminal.hpp"

namespace grapnel::app {
namespace {

// Relative error of a frequency beyond which a mode is not the expected one, or the units are wrong.
constexpr double kExpected = 0.01;
// Maximum number of modes if the command states none; a smaller model yields all its modes.
constexpr int kUsualModes = 20;

Mark option_mark(const std::string& argument) { return {std::make_shared<const std::string>(argument), 0, 0}; }

// Parses LENGTH-MASS-s.
std::optional<ElementUnits> units_of(const std::string& text, FaultList& faults) {
  struct Unit {
    std::string_view name;
    double size;
  };
  static constexpr std::array kLengths{Unit{"m", 1}, Unit{"cm", 0.01}, Unit{"mm", 0.001}, Unit{"in", 0.0254},
                                       Unit{"ft", 0.3048}};
  // Mass units of the pound-force systems: 1 lbf s^2/in, and 1 lbf s^2/ft.
  static constexpr std::array kMasses{Unit{"kg", 1}, Unit{"g", 0.001}, Unit{"t", 1000},
                                      Unit{"slinch", 0.45359237 * 9.80665 / 0.0254},
                                      Unit{"slug", 0.45359237 * 9.80665 / 0.3048}};
  const std::size_t first = text.find('-'), second = text.find('-', first == std::string::npos ? first : first + 1);
  if (second != std::string::npos && text.substr(second + 1) == "s") {
    const std::string_view length = std::string_view(text).substr(0, first),
                           mass = std::string_view(text).substr(first + 1, second - first - 1);
    for (const Unit& l : kLengths) {
      for (const Unit& m : kMasses) {
        if (l.name == length && m.name == mass) return ElementUnits{l.size, m.size};
      }
    }
  }
  faults.add(option_mark("--units " + text),
             "must be the model's units as LENGTH-MASS-s: m, cm, mm, in or ft; kg, g, t, slinch (lbf s^2/in) or slug "
             "(lbf s^2/ft); such as m-kg-s or mm-t-s");
  return std::nullopt;
}

std::optional<ElementInterface> interface_of(const ModesOptions& options, FaultList& faults) {
  ElementInterface interface;
  const bool by_rows = !options.interface_rows.empty();
  if (int(options.interface_node.has_value()) + int(!options.interface_nodes.empty()) + int(by_rows) > 1) {
    faults.add(option_mark("--interface"), "must be one of: a node, a list of nodes, rows");
    return std::nullopt;
  }
  interface.node = options.interface_node;
  if (!options.interface_nodes.empty()) {
    interface.nodes = read_node_places(options.interface_nodes, faults);
  }
  if (!options.node_places.empty()) interface.others = read_node_places(options.node_places, faults);
  for (std::vector<NodePlace>* nodes : {&interface.nodes, &interface.others}) {
    for (NodePlace& node : *nodes)
      node.x -= options.origin[0], node.y -= options.origin[1], node.z -= options.origin[2];
  }
  for (const int row : options.interface_rows) interface.rows.push_back(row - 1);
  if (by_rows && interface.rows.size() != 6)
    faults.add(option_mark("--interface-rows"),
               "must be six rows: translations along x, y and z, then rotations about them");
  return interface;
}

Node node_of(const ComponentModes& modes, const Mark& mark) {
  Node tree = mapping_node(mark);
  const auto put_list = [&](Node& mapping, const char* key, const Vector3d& v) {
    const std::array values{v[0] + 0.0, v[1] + 0.0, v[2] + 0.0};
    put(mapping, key, list_node(values, mark));
  };
  put(tree, "mass", number_node(modes.mass, mark));
  put_list(tree, "com", modes.com);
  const Symmetric3d& J = modes.inertia;
  const std::array inertia{J.xx, J.yy, J.zz, J.xy, J.xz, J.yz};
  put(tree, "inertia", list_node(inertia, mark));
  Node list = sequence_node(mark);
  for (const VibrationMode& mode : modes.modes) {
    Node one = mapping_node(mark);
    put(one, "frequency", number_node(mode.frequency, mark));
    put(one, "damping_ratio", number_node(mode.damping_ratio, mark));
    put_list(one, "translation", mode.translation);
    put_list(one, "rotation", mode.rotation);
    list.items.push_back(std::move(one));
  }
  put(tree, "modes", std::move(list));
  return tree;
}

void print(const ComponentModes& r, const ModesOptions& options) {
  to_stdout("{} and {}: {} degrees of freedom\n", printable_line(options.mass.string()),
            printable_line(options.stiffness.string()), r.degrees_of_freedom);
  to_stdout("mass {:.6g} kg, centre of mass [{:.6g}, {:.6g}, {:.6g}] m from the interface\n", r.mass, r.com[0],
            r.com[1], r.com[2]);
  const RigidBodyInertiad I = RigidBodyInertiad::about_com(r.mass, r.com, r.inertia);
  const std::array whole{r.mass, r.mass, r.mass, I.rotational.xx, I.rotational.yy, I.rotational.zz};
  to_stdout("\nmodes, clamped at the interface: effective mass along x, y, z and inertia about them, percent\n");
  to_stdout("  {:>4} {:>14} {:>8} {:>8} {:>8} {:>8} {:>8} {:>8}\n", "mode", "frequency", "x", "y", "z", "about x",
            "about y", "about z");
  std::array<double, 6> sum{};
  const auto row = [&](const std::string& name, const std::string& frequency, const std::array<double, 6>& part) {
    to_stdout("  {:>4} {:>14} {:8.3f} {:8.3f} {:8.3f} {:8.3f} {:8.3f} {:8.3f}\n", name, frequency, 100 * part[0],
              100 * part[1], 100 * part[2], 100 * part[3], 100 * part[4], 100 * part[5]);
  };
  for (std::size_t k = 0; k < r.modes.size(); ++k) {
    const VibrationMode& mode = r.modes[k];
    std::array<double, 6> part{};
    for (int i = 0; i < 3; ++i) {
      part[static_cast<std::size_t>(i)] =
          mode.translation[i] * mode.translation[i] / whole[static_cast<std::size_t>(i)];
      part[static_cast<std::size_t>(i) + 3] =
          mode.rotation[i] * mode.rotation[i] / whole[static_cast<std::size_t>(i) + 3];
    }
    for (std::size_t i = 0; i < 6; ++i) sum[i] += part[i];
    row(std::to_string(k + 1), fmt::format("{:.6g} Hz", mode.frequency), part);
  }
  row("all", "", sum);
  if (r.without_participation > 0)
    to_stdout("{} left out that cannot be excited through the interface\n",
              counted(static_cast<std::size_t>(r.without_participation), "mode"));
  if (r.next)
    to_stdout("modes from {:.6g} Hz on left out by {}: their mass moves rigidly with the interface\n", *r.next,
              *r.next > options.below ? fmt::format("--below {:g}", options.below)
                                      : fmt::format("--modes {}", options.modes.value_or(kUsualModes)));
}

// Compares the modes with the expected frequencies, in order.
void compare(const ComponentModes& r, const ModesOptions& options, FaultList& faults) {
  for (std::size_t k = 0; k < options.expected.size(); ++k) {
    const double expected = options.expected[k];
    if (k >= r.modes.size()) {
      faults.add(option_mark("--expect"),
                 fmt::format("mode {} is expected at {:g} Hz, but the matrices give only {} in the range", k + 1,
                             expected, counted(r.modes.size(), "mode")));
      return;
    }
    if (std::abs(r.modes[k].frequency / expected - 1) > kExpected)
      faults.add(option_mark("--expect"),
                 fmt::format("mode {} is at {:.6g} Hz, expected {:g} Hz: check the interface, and whether "
                             "both matrices are in the same units",
                             k + 1, r.modes[k].frequency, expected));
  }
}

}  // namespace

int modes_of_matrices(const ModesOptions& options) {
  try {
    FaultList faults;
    const auto units = units_of(options.units, faults);
    auto interface = interface_of(options, faults);
    auto mass = read_element_matrix(options.mass, options.mass_name, 'M', faults, options.row_names);
    auto stiffness = read_element_matrix(options.stiffness, options.stiffness_name, 'K', faults, options.row_names);
    faults.throw_if_any();
    Terminal terminal;
    if (!options.output.empty() && !may_write({options.output}, terminal)) return kBadInput;
    if (!interface->node && interface->nodes.empty() && interface->rows.empty() && mass->dofs.empty())
      interface->rows = {0, 1, 2, 3, 4, 5};
    if (options.modes && *options.modes > mass->size())
      faults.add(option_mark(fmt::format("--modes {}", *options.modes)),
                 fmt::format("the matrices have only {}", counted(static_cast<std::size_t>(mass->size()), "row")));
    const auto result = component_modes(std::move(*mass), std::move(*stiffness), *interface, *units,
                                        {options.modes.value_or(kUsualModes), options.below, options.damping}, faults);
    faults.throw_if_any();
    print(*result, options);
    compare(*result, options, faults);
    if (result->modes.empty())
      faults.add(option_mark(fmt::format("--below {:g}", options.below)),
                 result->next ? fmt::format("the first mode is at {:.6g} Hz", *result->next)
                              : std::string("no mode can be excited through the interface"));
    faults.throw_if_any();
    if (options.output.empty()) return kDone;
    const Mark mark = option_mark("grapnel modes");
    const std::string comment = fmt::format(
        "Made by grapnel modes from {} and {}: for a link of a robot or a panel of a target whose\n"
        "frame has the model's axes and its origin at the interface. SI units.",
        printable_line(options.mass.filename().string()), printable_line(options.stiffness.filename().string()));
    write_file_atomically(options.output, yaml_text(node_of(*result, mark), comment));
    to_stdout("{}: mass, com, inertia and {}\n", options.output.string(), counted(result->modes.size(), "mode"));
    return kDone;
  } catch (const InputError& error) {
    print_errors(error.faults());
    return kBadInput;
  } catch (const CannotWrite& error) {
    to_stderr("grapnel: error: {}\n", error_text(error));
    return kSimulationFailed;
  }
}

}  // namespace grapnel::app
