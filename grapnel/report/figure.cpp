#include "grapnel/report/figure.hpp"

#include <fmt/format.h>
#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>

#include "grapnel/report/figure_script.hpp"
#include "grapnel/result/atomic_file.hpp"

namespace grapnel {

namespace {

// The first eight after Okabe and Ito; the others differ from them by brightness.
constexpr std::array<const char*, 16> kColors{"#0072b2", "#d55e00", "#009e73", "#cc79a7", "#8a7400", "#56b4e9",
                                              "#e69f00", "#777777", "#332288", "#a01010", "#0b5d2e", "#e6194b",
                                              "#5a3a1a", "#40d0c0", "#9a32cd", "#111111"};
constexpr std::array<const char*, 4> kDashes{"solid", "(12,5)", "(3,4)", "(14,4,3,4)"};

std::array<int, 3> parts_of(const std::string& color) {
  const long value = std::strtol(color.c_str() + 1, nullptr, 16);
  return {static_cast<int>(value >> 16 & 0xff), static_cast<int>(value >> 8 & 0xff), static_cast<int>(value & 0xff)};
}

}  // namespace

const char* series_color(int index) { return kColors[static_cast<std::size_t>(index) % kColors.size()]; }
const char* series_dash(int index) { return kDashes[static_cast<std::size_t>(index) % kDashes.size()]; }

std::string line_style(const std::string& color, int dash, double width) {
  return fmt::format("lc rgb '{}' dt {} lw {:g}", color, series_dash(dash), width);
}

std::string lightened(const std::string& color, double share) {
  std::string mixed = "#";
  for (const int part : parts_of(color)) {
    mixed += fmt::format("{:02x}", static_cast<int>(std::lround(255 + (part - 255) * std::clamp(share, 0.0, 1.0))));
  }
  return mixed;
}

std::string translucent(const std::string& color, double opacity) {
  return fmt::format("#{:02x}{}", static_cast<int>(std::lround(255 * (1 - std::clamp(opacity, 0.0, 1.0)))),
                     color.substr(1));
}

namespace {

bool is_sweep(const std::filesystem::path& folder) { return std::filesystem::exists(folder / "study.json"); }

std::vector<FigureOffer> study_offers() {
  return {{"impulse-map", "a column of the table against an axis, a line per value of another axis, or a heat map"}};
}

std::vector<FigureOffer> run_offers(const RunSource& run) {
  std::vector<FigureOffer> offers = series_offers(run);
  if (has_impulses(run)) offers.push_back({"impulse", "impulse and angular impulse of every grasp"});
  if (has_window(run)) offers.push_back({"window", "evaluated capture times, and their limits"});
  if (run.scene) offers.push_back({"strobe", "superposed configurations of the whole system"});
  return offers;
}

void require_folder(const std::filesystem::path& folder) {
  if (!std::filesystem::is_directory(folder)) throw std::runtime_error(folder.string() + ": no such folder");
  if (!is_sweep(folder) && !is_campaign_folder(folder) && !std::filesystem::exists(folder / "timeseries.h5"))
    throw std::runtime_error(folder.string() +
                             ": the folder contains neither timeseries.h5 of a run nor study.json of a sweep nor "
                             "campaign.json of a campaign");
}

[[noreturn]] void not_offered(const FigureRequest& request, const std::vector<FigureOffer>& offers) {
  std::vector<std::string> names;
  for (const FigureOffer& offer : offers) names.push_back(offer.what);
  throw std::runtime_error(
      fmt::format("{} has no figure '{}'; it has: {}", request.folder.string(), request.what, fmt::join(names, ", ")));
}

bool offers(const std::vector<FigureOffer>& list, const std::string& what) {
  return std::any_of(list.begin(), list.end(), [&](const FigureOffer& offer) { return offer.what == what; });
}

}  // namespace

std::vector<FigureOffer> figure_offers(const std::filesystem::path& folder) {
  require_folder(folder);
  if (is_sweep(folder)) return study_offers();
  if (is_campaign_folder(folder)) return campaign_offers(folder);
  return run_offers(read_run_source(folder));
}

Figure make_figure(const FigureRequest& request) {
  require_folder(request.folder);
  if (is_sweep(request.folder)) {
    if (!offers(study_offers(), request.what)) not_offered(request, study_offers());
    return study_figure(read_study_source(request.folder), request);
  }
  if (is_campaign_folder(request.folder)) {
    const std::vector<FigureOffer> list = campaign_offers(request.folder);
    if (!offers(list, request.what)) not_offered(request, list);
    return campaign_figure(request);
  }
  const RunSource run = read_run_source(request.folder);
  if (request.what == "strobe") return strobe_figure(run, request);
  if (request.what == "impulse") return impulse_figure(run, request);
  if (request.what == "window" && has_window(run)) return window_figure(run, request);
  if (const std::vector<FigureOffer> list = run_offers(run); !offers(list, request.what)) not_offered(request, list);
  return series_figure(run, request);
}

FigureFiles figure_files(const std::filesystem::path& image) {
  FigureFiles files{image, image, image, false};
  files.data.replace_extension(".dat");
  files.script.replace_extension(".gp");
  return files;
}

FigureFiles write_figure(const Figure& figure, const std::filesystem::path& image) {
  FigureFiles files = figure_files(image);
  const std::string script = figure_script(figure, image.filename().string(), files.data.filename().string());
  write_file_atomically(files.data, figure_data(figure));
  write_file_atomically(files.script, script);
  // The same script with another output: gnuplot follows links, and leaves a partial image if it is stopped.
  AtomicFile drawn(image), drawing(files.script);
  const auto name = [](const AtomicFile& file) { return file.temporary().filename().string(); };
  drawing.write(figure_script(figure, image.filename().string(), files.data.filename().string(), name(drawn)));
  const GnuplotOutcome outcome = run_gnuplot(image.parent_path(), name(drawing));
  files.drawn = outcome.found;
  if (outcome.found && outcome.status != 0)
    throw std::runtime_error(fmt::format("{}: gnuplot fails with status {}: {}", files.script.string(), outcome.status,
                                         plain_line(outcome.message)));
  if (outcome.found) drawn.commit();
  return files;
}

}  // namespace grapnel
