#include "grapnel/compare/impulse_report.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "grapnel/compare/momentum_fields.hpp"
#include "grapnel/describe/json.hpp"
#include "grapnel/result/described_table.hpp"
#include "grapnel/result/json_document.hpp"
#include "grapnel/text/message_text.hpp"

namespace grapnel {
namespace {

enum class ImpulsesFormat { first };

}  // namespace

template <>
struct Described<ImpulsesFormat> {
  static constexpr Choice choices[] = {choice(ImpulsesFormat::first, "grapnel-impulses/1")};
  static constexpr Type type = enumeration<ImpulsesFormat>("ImpulsesFormat", choices);
};

template <>
struct Described<ImpulseReport::Grasp> {
  using T = ImpulseReport::Grasp;
  static constexpr Field fields[] = {
      field<&T::end_effector>("end_effector", "end-effector of the grasp"),
      field<&T::target>("target", "its target"),
      field<&T::components>("components",
                            "linear and angular impulse on the robot, at the end-effector's origin, in W"),
      field<&T::covariance>("covariance", "squares of the units",
                            "covariance of the determined components, in their order, row by row"),
  };
  static constexpr Type type = structure<T>("MeasuredGrasp", "the estimated impulse at a grasp.", fields);
};

template <>
struct Described<ImpulseReport::Rate> {
  using T = ImpulseReport::Rate;
  static constexpr Field fields[] = {
      field<&T::quantity>("quantity", "name of the quantity in the mapping"),
      field<&T::component>("component", "its component"),
      field<&T::unit>("unit", "unit of the rate"),
      field<&T::before>("before", "as `unit`",
                        "rate just before the contact, from the polynomial of the samples before"),
      field<&T::after>("after", "as `unit`", "rate just after it"),
      field<&T::change>("change", "as `unit`", "after minus before"),
      field<&T::uncertainty>("uncertainty", "as `unit`", "standard uncertainty of the change"),
      field<&T::curvature>("curvature", "as `unit`",
                           "part of it: error of the polynomials, estimated by the same fit to the run"),
      field<&T::window>("window", "s", "length of the polynomials on either side"),
      field<&T::samples>("samples", "1", "samples in both windows"),
      field<&T::outliers>("outliers", "1", "isolated samples that the fit leaves out"),
      field<&T::chi_square>("chi_square", "1",
                            "of the samples about the polynomials, per degree of freedom, of all components together"),
      field<&T::residual>("residual", "1", "residual of the momentum balance, in standard uncertainties"),
  };
  static constexpr Type type =
      structure<T>("MeasuredRateChange", "the change of a measured rate at a contact.", fields);
};

template <>
struct Described<ImpulseReport::Contact> {
  using T = ImpulseReport::Contact;
  static constexpr Field fields[] = {
      field<&T::time>("time", "s", "time of the contact, of the run's clock; its beginning, if it has a duration"),
      field<&T::end>("end", "s", "its end; equal for an instant"),
      field<&T::detected>("detected", "whether the log determined the time; else the user stated it"),
      field<&T::time_uncertainty>("time_uncertainty", "s", "standard uncertainty of a detected time"),
      field<&T::statistic>("statistic", "1", "root of the chi-square of a detected step"),
      field<&T::threshold>("threshold", "1", "the statistic from which on a step is detected"),
      field<&T::simulated_time>("simulated_time", "s", "the contact of the run that it is related to"),
      field<&T::verdict>("consistent",
                         "whether the measured changes satisfy the momentum balance of the model; not_checked without "
                         "redundant measurements"),
      field<&T::reason>("reason", "the values behind the verdict"),
      field<&T::chi_square>("chi_square", "1",
                            "of the residuals of the balance, per degree of freedom; absent without redundancy"),
      field<&T::chi_square_bound>("chi_square_bound", "1", "largest value that is consistent"),
      field<&T::unknowns>("unknowns", "1", "number of unknown components of impulses"),
      field<&T::rank>("rank", "1", "number of their combinations that the measurements determine"),
      field<&T::rows>("rows", "1", "number of measured changes"),
      field<&T::freedom>("freedom", "1", "rows minus rank: number of redundant measurements"),
      field<&T::grasps>("grasps", "the impulses at grasps"),
      field<&T::drives>("drives", "impulses of drives and brakes that kept a rate"),
      field<&T::null_space>("null_space", "N s and N m s",
                            "each a combination of impulses that changes no measurement: of the constrained components "
                            "of the grasps in order, then of the drives; its largest entry is 1"),
      field<&T::rates>("rates", "the measured changes of rates"),
      field<&T::assumed>("assumed", "places that are not measured and are therefore those of the run"),
      field<&T::zero_efforts>("zero_efforts",
                              "of a contact with a duration: joints and wheels whose effort is not measured and counts "
                              "as exactly zero; it is not part of the uncertainty"),
  };
  static constexpr Type type = structure<T>("MeasuredContact", "the impulses of one contact.", fields);
};

template <>
const Type& type_of<ImpulseReport>() {
  using T = ImpulseReport;
  static constexpr Field fields[] = {
      derived<[](const T&) { return ImpulsesFormat::first; }>("schema", "", "format of this file"),
      field<&T::version>("version", "version of Grapnel"),
      field<&T::verdict>("consistent",
                         "no: the balance of a contact is violated; yes: those of all contacts with redundant "
                         "measurements are satisfied; not_checked: there are none"),
      field<&T::scenario>("scenario", "name of the run's scenario"),
      field<&T::sha256>("sha256", "SHA-256 of the scenario"),
      field<&T::log>("log", "name of the log, without its folder"),
      field<&T::log_sha256>("log_sha256", "SHA-256 of the log"),
      field<&T::offset>("offset", "s", "time of the run minus time of the log"),
      field<&T::offset_uncertainty>("offset_uncertainty", "s", "its standard uncertainty; absent if it is stated"),
      field<&T::false_alarms>("false_alarms", "1",
                              "bound on the expected number of contacts that noise alone causes in this log"),
      field<&T::detection_window>("detection_window", "s",
                                  "window of the test for contacts, on either side; absent: the times are stated"),
      field<&T::contacts>("contacts", "the contacts, in the order of time"),
      field<&T::momentum>("momentum", "momentum and energy of the robot and of each target"),
      field<&T::unused>("unused", "quantities of the mapping that say nothing about impulses, with the reason"),
      field<&T::warnings>("warnings", "doubts about the results"),
  };
  static constexpr Type type = structure<T>("MeasuredImpulses", "impulses and momentum of measured motion.", fields);
  return type;
}

std::size_t ImpulseReport::count(Verdict of) const {
  return static_cast<std::size_t>(
      std::count_if(contacts.begin(), contacts.end(), [&](const Contact& c) { return c.verdict == of; }));
}

std::string impulse_report_json(const ImpulseReport& report) { return json_text(json_of(report)); }

std::string impulse_report_csv(const ImpulseReport& report) {
  std::string csv = "contact,time [s],end-effector,target,component,unit,determined,value,uncertainty,simulated\n";
  for (std::size_t i = 0; i < report.contacts.size(); ++i) {
    const ImpulseReport::Contact& contact = report.contacts[i];
    const auto add = [&](const std::string& end_effector, const std::string& target,
                         const ImpulseReport::Component& c) {
      csv += std::to_string(i) + ",";
      append_csv_number(contact.time, csv);
      csv += "," + csv_quoted(end_effector) + "," + csv_quoted(target) + "," + csv_quoted(c.name) + "," + c.unit +
             (c.determined ? ",yes" : ",no");
      for (const std::optional<double>& x : {c.value, c.uncertainty, c.simulated}) {
        csv += ",";
        if (x) append_csv_number(*x, csv);
      }
      csv += "\n";
    };
    for (const ImpulseReport::Grasp& g : contact.grasps) {
      for (const ImpulseReport::Component& c : g.components) add(g.end_effector, g.target, c);
    }
    for (const ImpulseReport::Component& c : contact.drives) add("", "", c);
  }
  return csv;
}

std::string impulse_report_text(const ImpulseReport& report) {
  std::string text;
  for (const ImpulseReport::Contact& contact : report.contacts) {
    text += fmt::format("contact at t = {:.7g} s{}, {}\n\n", contact.time,
                        contact.end > contact.time ? fmt::format(" to {:.7g} s", contact.end) : "",
                        contact.detected ? fmt::format("detected, standard uncertainty {} s, statistic {} above {}",
                                                       small_number(contact.time_uncertainty.value_or(0)),
                                                       small_number(contact.statistic.value_or(0)),
                                                       small_number(contact.threshold.value_or(0)))
                                         : "as stated");
    TextTable table;
    table.row({"impulse on the robot", "unit", "estimate", "uncertainty", "simulated"});
    const auto add = [&](const std::string& name, const ImpulseReport::Component& c) {
      table.row({name + ", " + c.name, c.unit, c.determined ? optional_number(c.value) : "not determined",
                 optional_number(c.uncertainty), optional_number(c.simulated)});
    };
    for (const ImpulseReport::Grasp& g : contact.grasps) {
      for (const ImpulseReport::Component& c : g.components) add(printable_line(g.end_effector), c);
    }
    for (const ImpulseReport::Component& c : contact.drives) add("drive", c);
    text += table.text() + "\n" + paragraph(contact.reason, "");
    text += fmt::format("{} of {} combinations of components determined by {}\n", contact.rank, contact.unknowns,
                        counted(contact.rows, "measured change"));
    if (!contact.assumed.empty()) text += paragraph("not measured, from the run: " + some_of(contact.assumed), "");
    if (!contact.zero_efforts.empty())
      text += paragraph("effort not measured, counted as zero: " + some_of(contact.zero_efforts), "");
    text += "\n";
  }
  text += momentum_report_text(report.momentum);
  for (const std::string& one : report.unused) text += paragraph(one, "");
  for (const std::string& warning : report.warnings) text += paragraph("warning: " + warning, "");
  const std::size_t checked = report.count(Verdict::yes) + report.count(Verdict::no);
  return text + fmt::format("\nconsistent: {} ({} of {} checked)\n", verdict_word(report.verdict), checked,
                            counted(report.contacts.size(), "contact"));
}

}  // namespace grapnel
