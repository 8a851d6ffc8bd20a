#include "grapnel/linear/linear_model.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>

#include "grapnel/describe/json.hpp"
#include "grapnel/result/described_table.hpp"
#include "grapnel/result/json_document.hpp"
#include "grapnel/result/result_documents.hpp"
#include "grapnel/text/message_text.hpp"

namespace grapnel {
namespace {

enum class LinearModelFormat { first };

}  // namespace

template <>
struct Described<LinearModelFormat> {
  static constexpr Choice choices[] = {choice(LinearModelFormat::first, "grapnel-linear-model/1")};
  static constexpr Type type = enumeration<LinearModelFormat>("LinearModelFormat", choices);
};

template <>
struct Described<LinearModel::Kind> {
  using Kind = LinearModel::Kind;
  static constexpr Choice choices[] = {choice(Kind::decays, "decays"),         choice(Kind::grows, "grows"),
                                       choice(Kind::oscillates, "oscillates"), choice(Kind::tumbles, "tumbles"),
                                       choice(Kind::drift, "drift"),           choice(Kind::conserved, "conserved")};
  static constexpr Type type = enumeration<Kind>("EigenvalueKind", choices);
};

template <>
struct Described<LinearModel::Variable> {
  using T = LinearModel::Variable;
  static constexpr Field fields[] = {
      field<&T::name>("name", "its name, as of time series"),
      field<&T::unit>("unit", "its unit"),
      field<&T::value>("value", "as `unit`", "at the operating point; absent: the operating point is the origin"),
  };
  static constexpr Type type =
      structure<T>("LinearVariable", "a state, an input or an output of a linear model.", fields);
};

template <>
struct Described<LinearModel::Sampled> {
  using T = LinearModel::Sampled;
  static constexpr Field fields[] = {
      field<&T::period>("period", "s", "sample time"),
      field<&T::delay>("delay", "s", "from a sample to the time from which its input acts"),
      field<&T::whole_periods>("whole_periods", "1", "n: whole periods in the delay"),
      field<&T::Ad>("Ad", "SI", "transition of the states from sample to sample; a list of rows"),
      field<&T::Bd>("Bd", "SI", "by the input of n samples ago"),
      field<&T::Bd_previous>("Bd_previous", "SI", "by the input of n + 1 samples ago; zero if the delay is n periods"),
  };
  static constexpr Type type =
      structure<T>("SampledModel", "the model without laws, under inputs that are held from sample to sample.", fields);
};

template <>
struct Described<LinearModel::Eigenvalue> {
  using T = LinearModel::Eigenvalue;
  static constexpr Field fields[] = {
      field<&T::kind>(
          "kind",
          "decays; grows; oscillates: neither; tumbles: grows or oscillates, but not faster than a base rotates whose "
          "rotation no law controls; drift: zero within the accuracy, or of positions without an effect; "
          "conserved: of a conserved momentum"),
      field<&T::real>("real", "1/s", "real part; of a sampled loop of the equivalent ln(z)/period").or_null(),
      field<&T::imaginary>("imaginary", "1/s", "imaginary part"),
      field<&T::z_real>("z_real", "1", "of a sampled loop: real part of z"),
      field<&T::z_imaginary>("z_imaginary", "1", "imaginary part of z"),
      field<&T::frequency>("frequency", "rad/s", "magnitude").or_null(),
      field<&T::damping_ratio>("damping_ratio", "1", "minus real part over magnitude; absent: the eigenvalue is zero"),
      field<&T::state>(
          "state",
          "state that participates most in the mode: largest product of the components of left and right eigenvector"),
  };
  static constexpr Type type = structure<T>("LinearEigenvalue", "an eigenvalue.", fields);
};

template <>
struct Described<LinearModel::Modes> {
  using T = LinearModel::Modes;
  static constexpr Field fields[] = {
      field<&T::verdict>(
          "verdict",
          "unstable: an eigenvalue grows; marginal: none grows, one oscillates; stable: all decay; those of "
          "tumbling, drift and conserved momenta do not count"),
      field<&T::reason>("reason", "the eigenvalue behind the verdict"),
      field<&T::eigenvalues>("eigenvalues", "the least stable first, then drift and conserved ones"),
  };
  static constexpr Type type = structure<T>("LinearModes", "eigenvalues and their verdict.", fields);
};

template <>
struct Described<LinearModel::ClosedLoop> {
  using T = LinearModel::ClosedLoop;
  static constexpr Field fields[] = {
      field<&T::laws>("laws", "the laws that act"),
      field<&T::stability>("stability", "eigenvalues of the controlled system"),
      field<&T::sampled>("sampled",
                         "whether the laws are sampled: then the eigenvalues are those from sample to sample"),
      field<&T::states>("states", "names of the states of `K`: without joints that move as prescribed"),
      field<&T::K>("K", "SI", "inputs by the states, u = K x, without sampling; a list of rows"),
      field<&T::margins>("margins", "margins of each channel"),
      field<&T::margins_absent>("margins_absent", "why there are none; empty: there are"),
  };
  static constexpr Type type = structure<T>("LinearClosedLoop", "the system with the scenario's own laws.", fields);
};

template <>
const Type& type_of<LinearModel>() {
  using T = LinearModel;
  static constexpr Field fields[] = {
      derived<[](const T&) { return LinearModelFormat::first; }>("schema", "", "format of this file"),
      field<&T::version>("version", "version of Grapnel"),
      field<&T::scenario>("scenario", "name of the scenario"),
      field<&T::sha256>("sha256", "SHA-256 of the scenario"),
      field<&T::time>("time", "s", "time of the operating point"),
      field<&T::phase>("phase", "phase of the motion that begins or continues there"),
      field<&T::states>("states", "x: deviations of positions, then of rates"),
      field<&T::inputs>("inputs", "u: deviations of efforts, of the wrench on the base in its axes, of thrusts"),
      field<&T::outputs>("outputs", "y: deviations"),
      field<&T::A>("A", "SI", "x' by x; a list of rows"),
      field<&T::B>("B", "SI", "x' by u"),
      field<&T::C>("C", "SI", "y by x"),
      field<&T::D>("D", "SI", "y by u"),
      field<&T::difference_error>("difference_error", "1",
                                  "estimated error of the differences, over the largest entry of A"),
      field<&T::sampled>("sampled", "with a sample time: the model from sample to sample"),
      field<&T::open_loop>("open_loop", "eigenvalues of A"),
      field<&T::closed_loop>("closed_loop", "the system with the scenario's own laws"),
      field<&T::closed_loop_absent>("closed_loop_absent", "why there is none; empty: there is"),
      field<&T::notes>("notes", "what the model does not contain, and how it takes nonlinear parts"),
      field<&T::warnings>("warnings", "doubts, and instability"),
  };
  static constexpr Type type = structure<T>("LinearModel", "the linear model of a scenario at a time.", fields);
  return type;
}

LinearModel::Matrix rows_of(const Eigen::MatrixXd& matrix) {
  LinearModel::Matrix rows(static_cast<std::size_t>(matrix.rows()));
  for (Eigen::Index i = 0; i < matrix.rows(); ++i) {
    for (Eigen::Index j = 0; j < matrix.cols(); ++j) rows[static_cast<std::size_t>(i)].push_back(matrix(i, j) + 0.0);
  }
  return rows;
}

Eigen::MatrixXd matrix_of(const LinearModel::Matrix& rows, std::size_t columns) {
  if (!rows.empty()) columns = rows.front().size();
  Eigen::MatrixXd matrix(static_cast<Eigen::Index>(rows.size()), static_cast<Eigen::Index>(columns));
  for (std::size_t i = 0; i < rows.size(); ++i) {
    for (std::size_t j = 0; j < columns; ++j)
      matrix(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j)) = rows[i][j];
  }
  return matrix;
}

LinearModel::Matrix gain_of_all_states(const LinearModel& model) {
  const LinearModel::ClosedLoop& loop = model.closed_loop.value();
  LinearModel::Matrix K(loop.K.size(), std::vector<double>(model.states.size(), 0.0));
  for (std::size_t i = 0; i < model.states.size(); ++i) {
    const auto own = std::find(loop.states.begin(), loop.states.end(), model.states[i].name);
    if (own == loop.states.end()) continue;
    for (std::size_t u = 0; u < K.size(); ++u) K[u][i] = loop.K[u][static_cast<std::size_t>(own - loop.states.begin())];
  }
  return K;
}

std::string linear_model_json(const LinearModel& model) { return json_text(json_of(model)); }

// --- Text ---

namespace {

constexpr std::size_t kMostEigenvalues = 12;

std::string word(LinearModel::Kind kind) { return std::string(name_of(kind)); }

void add_modes(const LinearModel::Modes& modes, std::string& text) {
  TextTable table;
  const bool sampled = std::ranges::any_of(modes.eigenvalues, [](const auto& e) { return e.z_real.has_value(); });
  std::vector<std::string> head{"eigenvalue [1/s]", "frequency [rad/s]", "damping", "kind", "mainly in"};
  if (sampled) head.insert(head.begin() + 1, "|z|");
  table.row(head);
  std::size_t shown = 0, left_out = 0;
  for (const LinearModel::Eigenvalue& e : modes.eigenvalues) {
    if (e.imaginary < 0) continue;  // its conjugate is shown
    const bool free = e.kind == LinearModel::Kind::drift || e.kind == LinearModel::Kind::conserved;
    if (free || shown == kMostEigenvalues) {
      left_out += free ? 0 : 1;
      continue;
    }
    ++shown;
    std::vector<std::string> row{
        e.imaginary == 0 ? fmt::format("{:.4g}", e.real) : fmt::format("{:.4g} +- {:.4g}i", e.real, e.imaginary),
        short_number(e.frequency), e.damping_ratio ? small_number(*e.damping_ratio) : "-", word(e.kind),
        printable_line(e.state)};
    if (sampled) row.insert(row.begin() + 1, short_number(std::hypot(e.z_real.value_or(0), e.z_imaginary.value_or(0))));
    table.row(row);
  }
  if (shown > 0) text += table.text();
  if (left_out > 0) text += fmt::format("  and {} that decay faster\n", left_out);
  text += paragraph(fmt::format("{}: {}", name_of(modes.verdict), printable_line(modes.reason)), "") + "\n";
}

std::string gain_text(const std::optional<double>& factor) {
  return factor ? fmt::format("{} ({:+.1f} dB)", small_number(*factor), 20 * std::log10(*factor)) : "none";
}

void add_margins(const LinearModel::ClosedLoop& loop, std::string& text) {
  if (!loop.margins_absent.empty()) {
    text += paragraph("no margins: " + loop.margins_absent, "") + "\n";
    return;
  }
  TextTable table;
  table.row({"channel, others closed", "gain at most", "gain at least", "phase [deg]", "at [rad/s]", "delay [s]"});
  for (const LinearModel::Margin& m : loop.margins) {
    const auto number = [](const std::optional<double>& x, double factor) {
      return x ? short_number(*x * factor) : "-";
    };
    table.row({printable_line(m.channel), gain_text(m.gain_maximum), gain_text(m.gain_minimum),
               number(m.phase, 180 / std::numbers::pi), number(m.phase_frequency, 1), number(m.delay, 1)});
  }
  text += table.text() + "\n";
}

}  // namespace

std::string linear_model_text(const LinearModel& model) {
  std::string text = fmt::format("linear model at t = {:.9g} s, phase {}: {}, {}, {}\n\n", model.time,
                                 printable_line(model.phase), counted(model.states.size(), "state"),
                                 counted(model.inputs.size(), "input"), counted(model.outputs.size(), "output"));
  text += "without controllers\n\n";
  add_modes(model.open_loop, text);
  if (model.closed_loop) {
    const LinearModel::ClosedLoop& loop = *model.closed_loop;
    std::string laws;
    for (const std::string& law : loop.laws) laws += (laws.empty() ? "" : ", ") + law;
    text += paragraph(fmt::format("with {}{}", printable_line(laws), loop.sampled && model.sampled ? ", sampled" : ""),
                      "") +
            "\n";
    add_modes(loop.stability, text);
    add_margins(loop, text);
  } else {
    text += paragraph("no closed loop: " + printable_line(model.closed_loop_absent), "") + "\n";
  }
  for (const std::string& note : model.notes) text += paragraph("note: " + printable_line(note), "");
  for (const std::string& warning : model.warnings) text += paragraph("warning: " + printable_line(warning), "");
  return text;
}

}  // namespace grapnel
