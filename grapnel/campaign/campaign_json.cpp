// Descriptions of the fields of campaign.json and study.json, from which the tables of docs/formats, the schemas and
// the viewer's types are generated.
#include <nlohmann/json.hpp>

#include "grapnel/campaign/campaign_report.hpp"
#include "grapnel/describe/json.hpp"

namespace grapnel {
namespace {

using Report = CampaignReport;

enum class CampaignReportFormat { first };
enum class StudyTableFormat { first };

// Parts of a document without separate structures in the program.
struct CaseCounts {};
struct SuccessRate {};
struct BinsOf {};
struct SensitivityOfAll {};
struct GroupIndices {};
struct SuccessMap {};

struct UnmetCriterion {
  std::string criterion;
  std::vector<std::uint64_t> counts;  // per point of the design
};
struct PointsAbove {
  double level = 0;
  std::size_t points = 0;
};
struct SuccessMapAxis : StudyAxis {};

template <double Sensitivity::*member>
std::vector<double> each_of(const std::vector<Sensitivity>& indices) {
  std::vector<double> numbers;
  for (const Sensitivity& one : indices) numbers.push_back(one.*member);
  return numbers;
}

// One number per point of the success map.
template <class Get>
auto per_point(const Report& report, Get&& get) {
  std::vector<std::remove_cvref_t<decltype(get(report.success_map.front()))>> list;
  for (const SuccessMapPoint& point : report.success_map) list.push_back(get(point));
  return list;
}

std::vector<UnmetCriterion> unmet_criteria(const Report& report) {
  std::vector<UnmetCriterion> list;
  for (std::size_t c = 0; c < report.criteria.size(); ++c)
    list.push_back({report.criteria[c].name, per_point(report, [&](const SuccessMapPoint& p) { return p.unmet[c]; })});
  return list;
}

// Campaign files are checked for UTF-8; campaigns made by a program may contain other bytes.
std::string text_of(const nlohmann::ordered_json& json, int indent) {
  return json.dump(indent, ' ', false, nlohmann::ordered_json::error_handler_t::replace) + "\n";
}

}  // namespace

template <>
struct Described<CampaignReportFormat> {
  static constexpr Choice choices[] = {choice(CampaignReportFormat::first, "grapnel-campaign-report/1")};
  static constexpr Type type = enumeration<CampaignReportFormat>("CampaignReportFormat", choices);
};

template <>
struct Described<Report::Settings> {
  using T = Report::Settings;
  static constexpr Field fields[] = {
      field<&T::name>("name", "name of the campaign"),
      field<&T::description>("description", "description of the campaign"),
      field<&T::file>("file", "name of the campaign file, without folders"),
      field<&T::sha256>("sha256", "SHA-256 of its bytes and of the files that it names"),
      field<&T::seed>("seed", "seed as text: up to 64 bits"),
      field<&T::sampling>("sampling", "as in the file"),
      field<&T::simulate>("simulate", "as in the file"),
      field<&T::plan>("plan", "as in the file"),
      field<&T::cases>("cases", "1", "number of cases, including extensions; with a design per point of it"),
      field<&T::total>("total", "1", "number of cases at all points of a design"),
  };
  static constexpr Type type = structure<T>("CampaignSettings", "settings of the campaign.", fields);
};

template <>
struct Described<CaseCounts> {
  static constexpr Field fields[] = {
      derived<[](const Report& r) { return r.status[0]; }>("ok", "1", "cases that completed"),
      derived<[](const Report& r) { return r.status[1]; }>("failed", "1", "cases that failed"),
      derived<[](const Report& r) { return r.status[2]; }>("unreachable", "1",
                                                           "cases for which no configuration was found"),
      field<&Report::success>("success", "1", "cases that are ok and meet all criteria"),
  };
  static constexpr Type type = structure<CaseCounts>("CaseCounts", "how the cases ended.", fields);
};

template <>
struct Described<SuccessRate> {
  static constexpr Field fields[] = {
      derived<[](const Report& r) { return r.success_rate().estimate; }>("estimate", "1",
                                                                         "successes over all rows; null: no rows")
          .or_null(),
      derived<[](const Report& r) { return r.success_rate().lower; }>("lower", "1", "lower end of its interval"),
      derived<[](const Report& r) { return r.success_rate().upper; }>("upper", "1", "likewise"),
      field<&Report::confidence>("confidence", "1", "confidence of this interval and of all other intervals here"),
      field<&Report::assumed>(
          "assumed", "1", "successes with a grasp that is assumed to hold because its end-effector has no envelope"),
  };
  static constexpr Type type =
      structure<SuccessRate>("SuccessRate", "the probability of success, with Wilson's score interval (1927).", fields);
};

template <>
struct Described<Report::Limit> {
  using T = Report::Limit;
  static constexpr Field fields[] = {
      field<&T::name>("name", "name of a column or an input"),
      field<&T::bound>("at_most", "as the number", "upper limit")
          .or_null()
          .when<[](const T& l) { return l.at_most; }>(),
      field<&T::bound>("at_least", "as the number", "lower limit; a limit has one of the two")
          .or_null()
          .when<[](const T& l) { return !l.at_most; }>(),
      field<&T::magnitude>("magnitude", "true: the limit applies to the magnitude"),
  };
  static constexpr Type type = structure<T>("CriterionLimit", "limit of a criterion on a single number.", fields);
};

template <>
struct Described<Report::CriterionCount> {
  using T = Report::CriterionCount;
  static constexpr Field fields[] = {
      field<&T::name>("name", "name in the file, else its text"),
      field<&T::text>("text", "text of the expression"),
      field<&T::met>("met", "1", "rows that are ok and meet the criterion"),
      derived<[](const T& c) { return c.share.estimate; }>("estimate", "1", "these over all rows; null: no rows")
          .or_null(),
      derived<[](const T& c) { return c.share.lower; }>("lower", "1", "lower end of its interval"),
      derived<[](const T& c) { return c.share.upper; }>("upper", "1", "likewise"),
      field<&T::only_this>("only_this", "1",
                           "rows that are ok and in which no other criterion fails; other criteria may not have been "
                           "checked, such as an impulse without a capture"),
      field<&T::not_checked>("not_checked", "1", "rows that are ok in which a decisive number does not exist"),
      field<&T::reads>("reads", "names of columns and inputs"),
      field<&T::limits>("limits", "limits on single numbers, if the criterion can be expressed by them"),
  };
  static constexpr Type type =
      structure<T>("CriterionResult", "results per criterion, in the order of the file.", fields);
};

// ---- Distributions ----

template <>
struct Described<QuantileEstimate> {
  using T = QuantileEstimate;
  static constexpr Field fields[] = {
      field<&T::probability>("probability", "1", "requested probability"),
      field<&T::value>("value", "as the number",
                       "interpolated between order statistics: Hyndman and Fan 1996, type 7; null: no numbers")
          .or_null(),
      field<&T::lower>("lower", "as the number",
                       "order statistic; the quantile is between `lower` and `upper` with at least the confidence, for "
                       "any distribution; null: the sample is too small")
          .or_null(),
      field<&T::upper>("upper", "as the number", "order statistic, likewise").or_null(),
  };
  static constexpr Type type = structure<T>("Quantile", "value that is not exceeded with a given probability.", fields);
};

template <>
struct Described<BinsOf> {
  using T = Report::Numbers;
  static constexpr Field fields[] = {
      derived<[](const T& n) { return n.histogram.begin; }>("begin", "as the number", "start of the first bin"),
      derived<[](const T& n) { return n.histogram.end; }>("end", "as the number",
                                                          "end of the last bin, which includes it"),
      derived<[](const T& n) { return n.histogram.counts; }>(
          "counts", "1",
          "counts of bins of equal width. Whole numbers in a small range have one bin each, centred on them; equal "
          "numbers have one bin of width 0"),
      field<&T::successes>("successes", "1", "number of successes in each bin"),
      derived<[](const T& n) { return n.histogram.below; }>(
          "below", "1", "numbers below the first bin, if a few outliers would leave all other numbers in one bin"),
      derived<[](const T& n) { return n.histogram.above; }>("above", "1", "numbers beyond the last bin"),
  };
  static constexpr Type type = structure<BinsOf>("Histogram", "distribution of numbers.", fields);
};

template <>
struct Described<Report::SuccessBy> {
  using T = Report::SuccessBy;
  static constexpr Field fields[] = {
      field<&T::from>("from", "as the number", "smallest value of each group"),
      field<&T::to>("to", "as the number", "largest value of each group"),
      field<&T::trials>("trials", "1", "rows of each group"),
      field<&T::successes>("successes", "1", "successes of each group"),
  };
  static constexpr Type type = structure<T>(
      "SuccessBy", "up to 20 groups of rows, of as equal a size as possible, by the value of an input.", fields);
};

template <>
struct Described<Report::Numbers> {
  using T = Report::Numbers;
  static constexpr Field fields[] = {
      derived<[](const T& n) { return n.head.name; }>("name", "", "name of the column or the input"),
      derived<[](const T& n) { return n.head.unit; }>("unit", "", "unit of its numbers"),
      derived<[](const T& n) { return n.head.description; }>("description", "",
                                                             "description of the column or the input"),
      derived<[](const T& n) { return n.description.count; }>("count", "1", "number of finite values"),
      derived<[](const T& n) { return n.description.missing; }>("missing", "1", "others"),
      derived<[](const T& n) { return n.description.mean; }>("mean", "as the number", "mean; null: no numbers")
          .or_null(),
      derived<[](const T& n) { return n.description.mean_error; }>("mean_error", "as the number",
                                                                   "standard error of the mean")
          .or_null(),
      derived<[](const T& n) { return n.description.standard_deviation; }>(
          "standard_deviation", "as the number", "standard deviation with n − 1; null: too few numbers")
          .or_null(),
      derived<[](const T& n) { return n.description.least; }>("least", "as the number", "minimum").or_null(),
      derived<[](const T& n) { return n.description.largest; }>("largest", "as the number", "maximum").or_null(),
      derived<[](const T& n) { return n.description.quantiles; }>("quantiles", "",
                                                                  "quantiles at the probabilities of the file"),
      group<T, BinsOf>("histogram", "histogram of the finite numbers"),
      field<&T::success_by>("success_by", "for inputs only: success by the input's value"),
  };
  static constexpr Type type = structure<T>("Distribution", "distribution of an input or a column.", fields);
};

// ---- Sensitivity ----

template <>
struct Described<Report::InputGroup> {
  using T = Report::InputGroup;
  static constexpr Field fields[] = {
      field<&T::name>("name", "name of the group"),
      derived<[](const T& g) { return g.inputs.empty(); }>("design", "", "true: an axis of the design, without inputs"),
      field<&T::names>("inputs", "names of the inputs in the group"),
  };
  static constexpr Type type = structure<T>("InputGroup",
                                            "related inputs: the components of a vector, position and orientation of a "
                                            "pose, all drawn values of a grasp point.",
                                            fields);
};

template <>
struct Described<Report::Measure::Of> {
  using T = Report::Measure::Of;
  static constexpr Choice choices[] = {choice(T::success, "success", "1 or 0, over all rows."),
                                       choice(T::criterion, "criterion", "over the rows that are ok."),
                                       choice(T::column, "column")};
  static constexpr Type type = enumeration<T>("MeasureOf", choices);
};

template <>
struct Described<GroupIndices> {
  using T = Report::Measure;
  static constexpr Field fields[] = {
      derived<[](const T& m) { return each_of<&Sensitivity::first_order>(m.groups); }>(
          "first_order", "1",
          "per group; for several inputs the variance of a quadratic function of them, fitted by least squares to at "
          "most 20 000 rows, minus the expected contribution of chance (adjusted R²), or the largest index of one of "
          "them if that is larger: a lower bound, exact for quadratic functions; null if there are fewer than ten rows "
          "or fewer than twice the terms")
          .or_null(),
      derived<[](const T& m) { return each_of<&Sensitivity::error>(m.groups); }>("error", "1", "its standard error")
          .or_null(),
      derived<[](const T& m) { return each_of<&Sensitivity::rank_correlation>(m.groups); }>(
          "rank_correlation", "1", "rank correlation; null for groups of several inputs")
          .or_null(),
  };
  static constexpr Type type = structure<GroupIndices>(
      "GroupIndices", "variance explained by groups of inputs, in the order of `sensitivity.groups`.", fields);
};

template <>
struct Described<Report::Measure> {
  using T = Report::Measure;
  static constexpr Field fields[] = {
      field<&T::name>("name", "name of the quantity"),
      field<&T::unit>("unit", "unit of the quantity"),
      field<&T::of>("of", "kind of the quantity."),
      field<&T::count>("count", "1", "rows in which it exists"),
      derived<[](const T& m) { return each_of<&Sensitivity::first_order>(m.inputs); }>(
          "first_order", "1",
          "per input: Sobol's index Var(E[y|x]) / Var(y), the part of the variance that would vanish if the input were "
          "known; by chance it may be slightly negative")
          .or_null(),
      derived<[](const T& m) { return each_of<&Sensitivity::error>(m.inputs); }>("error", "1", "its standard error")
          .or_null(),
      derived<[](const T& m) { return each_of<&Sensitivity::rank_correlation>(m.inputs); }>(
          "rank_correlation", "1", "Spearman's rank correlation, per input")
          .or_null(),
      group<T, GroupIndices>("groups", "the same for groups of inputs"),
      field<&T::unexplained>("unexplained", "1",
                             "1 minus the sum of the groups: the share of the variance that no group alone explains, "
                             "but interactions of groups, influences that are not drawn, or the error of the fit")
          .or_null(),
  };
  static constexpr Type type = structure<T>("Measure", "a quantity that is compared with every input.", fields);
};

template <>
struct Described<SensitivityOfAll> {
  static constexpr Field fields[] = {
      derived<[](const Report& r) {
        std::vector<std::string> names;
        for (const Report::Numbers& input : r.inputs) names.push_back(input.head.name);
        return names;
      }>("inputs", "", "names of the inputs"),
      field<&Report::groups>("groups", "groups of inputs, and the axes of a design"),
      field<&Report::measures>("measures",
                               "first `success`; then each criterion, if there are several; then the numbers that "
                               "criteria read, the used share of each tolerance, and the other columns in their order, "
                               "at most 64 besides criteria. Constant columns are not included"),
      field<&Report::measures_left_out>("left_out", "1", "further columns without an entry"),
      field<&Report::rounding>("rounding",
                               "columns whose numbers differ only by rounding error, which are not included either: by "
                               "less than 1e-9 of the largest among them and the other components of their vector, or "
                               "all below 1e-9 of the largest number of their unit"),
  };
  static constexpr Type type = structure<SensitivityOfAll>(
      "SensitivityOfAll", "sensitivity of results to inputs, computed from the rows.", fields);
};

// ---- Cases ----

template <>
struct Described<Report::Case> {
  using T = Report::Case;
  static constexpr Field fields[] = {
      field<&T::index>("index", "1", "k"),
      field<&T::value>("value", "as the number", "value of this case"),
      field<&T::success>("success", "whether the case is a success"),
      field<&T::inputs>("inputs", "as drawn", "drawn values in the order of `inputs`").or_null(),
      field<&T::replay>("replay",
                        "command that runs this case with its full report, in the folder of the campaign file"),
  };
  static constexpr Type type = structure<T>("WorstCase", "one of the worst cases.", fields);
};

template <>
struct Described<Report::Worst> {
  using T = Report::Worst;
  static constexpr Field fields[] = {
      field<&T::name>("by", "name of the column"),
      field<&T::unit>("unit", "unit of its numbers"),
      derived<[](const T& w) { return std::string(w.largest ? "largest" : "least"); }>("direction", "",
                                                                                       "`largest`, `least`"),
      field<&T::magnitude>("magnitude", "true: sorted by magnitude"),
      field<&T::cases>("cases", "the worst first; of equal values the first case"),
  };
  static constexpr Type type = structure<T>(
      "WorstCases", "up to 10 cases, or `keep.series.worst.count`, with the worst values of a column.", fields);
};

template <>
struct Described<Report::Example> {
  using T = Report::Example;
  static constexpr Field fields[] = {
      field<&T::index>("index", "1", "k"),
      field<&T::reason>("reason", "reason of this case"),
      field<&T::replay>("replay", "command as for the worst cases"),
  };
  static constexpr Type type = structure<T>("ReasonExample", "a case with the reason.", fields);
};

template <>
struct Described<Report::Reason> {
  using T = Report::Reason;
  static constexpr Field fields[] = {
      field<&T::status>("status", "status of these cases"),
      field<&T::text>(
          "reason",
          "for cases that are not ok their reason, with numbers replaced by `…` so that similar cases are counted "
          "together; failed conservation checks are one kind. For cases that are ok the criteria that they do not meet "
          "and, if a criterion requires closed grasps, the grasps that miss and the exceeded tolerance: "
          "`not met: captured (tip-1 misses by position); not checked: soft`"),
      field<&T::count>("count", "1", "cases"),
      field<&T::examples>("examples", "the first three cases"),
  };
  static constexpr Type type = structure<T>("Reason", "reason for which cases are not a success.", fields);
};

template <>
struct Described<Report::Grasp::Tolerance> {
  using T = Report::Grasp::Tolerance;
  static constexpr Field fields[] = {
      field<&T::name>("name", "`position`, `angle`, `velocity`, `angular_velocity`"),
      field<&T::exceeded>("exceeded", "1", "number of rows in which it was exceeded"),
      field<&T::limiting>(
          "limiting", "1",
          "number of rows in which the grasp missed and this tolerance was exceeded by the largest factor"),
  };
  static constexpr Type type = structure<T>("ToleranceCount", "how often a grasp's tolerance was exceeded.", fields);
};

template <>
struct Described<Report::Grasp> {
  using T = Report::Grasp;
  static constexpr Field fields[] = {
      field<&T::end_effector>("end_effector", "end-effector of the grasp"),
      field<&T::captured>("captured", "1", "rows that are ok in which it closed and was not lost"),
      field<&T::missed>("missed", "1", "rows that are ok in which it did not close, or was lost"),
      field<&T::tolerances>("tolerances", "tolerances of its envelope; empty: no envelope"),
  };
  static constexpr Type type = structure<T>("GraspCount", "results of one grasp.", fields);
};

// ---- Success map ----

template <>
struct Described<SuccessMapAxis> {
  using T = SuccessMapAxis;
  static constexpr Field fields[] = {
      field<&T::name>("name", "name of the axis"),
      field<&T::unit>("unit", "unit of its numbers"),
      field<&T::description>("description", "what the axis changes"),
      field<&T::is_numeric>("is_numeric", "whether its values are numbers"),
      derived<[](const T& axis) { return shown_values(axis); }>("values", "as stated",
                                                                "values as in the file, or labels"),
  };
  static constexpr Type type = structure<T>("SuccessMapAxis", "an axis of the design.", fields);
};

template <>
struct Described<UnmetCriterion> {
  using T = UnmetCriterion;
  static constexpr Field fields[] = {
      field<&T::criterion>("criterion", "name of the criterion"),
      field<&T::counts>(
          "counts", "1",
          "per point, cases that fail it; if a criterion fails, criteria that could not be checked do not count"),
  };
  static constexpr Type type = structure<T>("UnmetCriterion", "failures of one criterion.", fields);
};

template <>
struct Described<PointsAbove> {
  using T = PointsAbove;
  static constexpr Field fields[] = {
      field<&T::level>("level", "1", "level of the probability"),
      field<&T::points>("points", "1", "points at or above it, by the lower end of the interval"),
  };
  static constexpr Type type =
      structure<T>("PointsAbove", "number of points of the design above a probability of success.", fields);
};

template <>
struct Described<SuccessMap> {
  using Point = SuccessMapPoint;
  static constexpr Field fields[] = {
      derived<[](const Report& r) {
        std::vector<SuccessMapAxis> axes;
        for (const StudyAxis& axis : r.axes) axes.push_back({axis});
        return axes;
      }>("axes", "", "axes of the design"),
      field<&Report::confidence>("confidence", "1", "confidence of the intervals"),
      derived<[](const Report& r) { return per_point(r, [](const Point& p) { return p.success.trials; }); }>(
          "trials", "1", "rows"),
      derived<[](const Report& r) { return per_point(r, [](const Point& p) { return p.ok; }); }>("ok", "1",
                                                                                                 "rows that are ok"),
      derived<[](const Report& r) { return per_point(r, [](const Point& p) { return p.success.successes; }); }>(
          "successes", "1", "rows that are a success"),
      derived<[](const Report& r) { return per_point(r, [](const Point& p) { return p.success.estimate; }); }>(
          "estimate", "1", "successes over rows; null: no rows")
          .or_null(),
      derived<[](const Report& r) { return per_point(r, [](const Point& p) { return p.success.lower; }); }>(
          "lower", "1", "lower end of its interval"),
      derived<[](const Report& r) { return per_point(r, [](const Point& p) { return p.success.upper; }); }>(
          "upper", "1", "likewise"),
      derived<[](const Report& r) { return unmet_criteria(r); }>("unmet", "", "failures per criterion"),
      derived<[](const Report& r) {
        return per_point(r, [&](const Point& p) -> std::optional<std::string> {
          const auto deciding = p.deciding();
          if (!deciding) return std::nullopt;
          return *deciding < r.criteria.size() ? r.criteria[*deciding].name : "not ok";
        });
      }>("deciding", "",
         "the criterion that most of the point's cases fail, `not ok` if more cases have no result, null if all are a "
         "success")
          .or_null(),
      derived<[](const Report& r) {
        std::vector<PointsAbove> list;
        for (const double level : {0.5, 0.9, 0.99}) list.push_back({level, points_above(r.success_map, level)});
        return list;
      }>("above", "", "at three levels; the number in the report's headline"),
  };
  static constexpr Type type =
      structure<SuccessMap>("SuccessMap",
                            "success at the points of the design: lists, the first axis varying slowest. The same "
                            "uncertain numbers are drawn at every point, so that points differ only by the design.",
                            fields);
};

// ---- The documents ----

template <>
const Type& type_of<CampaignReport>() {
  using T = CampaignReport;
  static constexpr Field fields[] = {
      derived<[](const T&) { return CampaignReportFormat::first; }>("schema", "", "format of this file"),
      field<&T::version>("version", "version of Grapnel"),
      field<&T::settings>("campaign", "settings of the campaign"),
      field<&T::rows>("rows", "1", "cases on disk; all following results refer to them"),
      group<T, CaseCounts>("counts", "how the cases ended"),
      group<T, SuccessRate>("success", "success over all rows"),
      field<&T::warnings>("warnings",
                          "limits of the rates: criteria that never fail, never hold or were not checked, and assumed "
                          "successes. The terminal prints them too"),
      field<&T::criteria>("criteria", "criteria in the order of the file"),
      field<&T::inputs>("inputs", "drawn inputs"),
      field<&T::columns>("columns", "stored columns"),
      group<T, SensitivityOfAll>("sensitivity", "sensitivity of results to inputs"),
      field<&T::worst>(
          "worst", "the first list is by `keep.series.worst.by`, if given; then by the numbers that criteria limit"),
      field<&T::failures>(
          "failures",
          "reasons for which cases are not a success, the most frequent first, every case counted once; at most 50"),
      field<&T::failures_left_out>("failures_left_out", "1", "cases with other reasons"),
      field<&T::grasps>("grasps", "results per grasp, if the columns `grasps/*/captured` are stored"),
      field<&T::reasons>("reasons", "entries of `failures` whose cases are not ok; at most 50"),
      field<&T::reasons_left_out>("reasons_left_out", "1", "cases with other reasons"),
      group<T, SuccessMap>("success_map", "absent without a design").when<[](const T& r) { return !r.axes.empty(); }>(),
      field<&T::text>("text", "text of the campaign file"),
  };
  static constexpr Type type = structure<T>("CampaignReport", "results of the cases of a campaign.", fields);
  return type;
}

std::string campaign_json(const CampaignReport& report) { return text_of(json_of(report), 1); }

template <>
struct Described<StudyTableFormat> {
  static constexpr Choice choices[] = {choice(StudyTableFormat::first, "grapnel-study-table/1")};
  static constexpr Type type = enumeration<StudyTableFormat>("StudyTableFormat", choices);
};

template <>
struct Described<SweepReport::Settings> {
  using T = SweepReport::Settings;
  static constexpr Field fields[] = {
      field<&T::name>("name", "name of the study"),
      field<&T::file>("file", "name of the study file, without folders"),
      field<&T::sha256>("sha256",
                        "SHA-256 of its bytes, followed by that of the scenarios that were checked before the run"),
      field<&T::simulate>("simulate", "as in the file"),
  };
  static constexpr Type type = structure<T>("StudySettings", "settings of the study.", fields);
};

template <>
const Type& type_of<SweepReport>() {
  using T = SweepReport;
  static constexpr Field fields[] = {
      derived<[](const T&) { return StudyTableFormat::first; }>("schema", "", "format of this file"),
      field<&T::version>("version", "version of Grapnel"),
      field<&T::settings>("study", "settings of the study"),
      field<&T::points>("points", "1", "number of all points"),
      derived<[](const T& s) { return s.status[0]; }>("ok", "1", "points that completed"),
      derived<[](const T& s) { return s.status[1]; }>("failed", "1", "points that failed"),
      derived<[](const T& s) { return s.status[2]; }>("unreachable", "1",
                                                      "points for which no configuration was found"),
      field<&T::axes>("axes", "axes in the order of the file"),
      field<&T::columns>("columns", "columns of the table"),
      field<&T::text>("text", "text of the study file"),
  };
  static constexpr Type type = structure<T>("SweepReport", "settings of a sweep, and how its points ended.", fields);
  return type;
}

std::string sweep_json(const Campaign& sweep, std::span<const CaseRow> rows, const std::string& version) {
  SweepReport report{
      version,      {sweep.name, std::filesystem::path(sweep.file).filename().string(), sweep.sha256, sweep.mode},
      rows.size(),  {},
      sweep.design, sweep.columns,
      sweep.text};
  for (const CaseRow& row : rows) ++report.status[static_cast<std::size_t>(row.status)];
  return text_of(json_of(report), 2);
}

}  // namespace grapnel
