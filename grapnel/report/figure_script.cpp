#include "grapnel/report/figure_script.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>
#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <numeric>
#include <stdexcept>

#include "grapnel/report/figure.hpp"

namespace grapnel {

namespace {

bool is_control(unsigned char c) { return c < 0x20 || c == 0x7f; }

// Bytes of the UTF-8 character that begins at `at`; 0 if none does.
std::size_t character_length(std::string_view text, std::size_t at) {
  const auto byte = [&](std::size_t i) { return static_cast<unsigned char>(text[i]); };
  const unsigned char first = byte(at);
  const std::size_t length = first < 0x80                    ? 1
                             : first >= 0xc2 && first < 0xe0 ? 2
                             : first >= 0xe0 && first < 0xf0 ? 3
                             : first >= 0xf0 && first < 0xf5 ? 4
                                                             : 0;
  if (length == 0 || at + length > text.size()) return 0;
  for (std::size_t i = 1; i < length; ++i) {
    if ((byte(at + i) & 0xc0) != 0x80) return 0;
  }
  if (length > 2) {  // overlong forms, surrogates, beyond the last code point
    const unsigned char second = byte(at + 1);
    if ((first == 0xe0 && second < 0xa0) || (first == 0xed && second > 0x9f) || (first == 0xf0 && second < 0x90) ||
        (first == 0xf4 && second > 0x8f))
      return 0;
  }
  return length;
}

}  // namespace

std::string plain_line(std::string_view text) {
  std::string line;
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t length = character_length(text, at);
    if (length == 0) {
      line += '?';
    } else if (length == 1) {
      line += is_control(static_cast<unsigned char>(text[at])) ? ' ' : text[at];
    } else {
      line += text.substr(at, length);
    }
    at += std::max<std::size_t>(length, 1);
  }
  return line;
}

namespace {

// A constant of gnuplot, which reads two apostrophes as one within a constant but not four as two, nor three at its
// beginning: such apostrophes are written in a separate constant in double quotes.
std::string gnuplot_constant(std::string_view text) {
  std::string quoted = "'";
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t end = std::min(text.find_first_not_of('\'', at), text.size());
    if (end == at) {
      quoted += text[at++];
      continue;
    }
    const std::string apart = '"' + std::string(text.substr(at, end - at)) + "\".'";
    quoted = at == 0 ? apart : end == at + 1 ? quoted + "''" : quoted + "'." + apart;
    at = end;
  }
  return quoted + "'";
}

}  // namespace

std::string gnuplot_quoted(std::string_view text) { return gnuplot_constant(plain_line(text)); }

std::string gnuplot_tic_label(std::string_view text) {
  std::string doubled;
  for (const char c : text) doubled += c == '%' ? std::string("%%") : std::string(1, c);
  return gnuplot_quoted(doubled);
}

std::string gnuplot_file(std::string_view name) {
  if (std::any_of(name.begin(), name.end(), [](char c) { return is_control(static_cast<unsigned char>(c)); }))
    throw std::invalid_argument("a figure's file name must not have control characters: '" + plain_line(name) + "'");
  const bool plain = !name.empty() && ((name[0] >= 'a' && name[0] <= 'z') || (name[0] >= 'A' && name[0] <= 'Z') ||
                                       (name[0] >= '0' && name[0] <= '9'));
  return gnuplot_constant(plain ? std::string(name) : "./" + std::string(name));  // bytes unchanged
}

namespace {

class SpawnActions {
 public:
  SpawnActions() { posix_spawn_file_actions_init(&actions_); }
  ~SpawnActions() { posix_spawn_file_actions_destroy(&actions_); }
  SpawnActions(const SpawnActions&) = delete;
  SpawnActions& operator=(const SpawnActions&) = delete;
  posix_spawn_file_actions_t* get() { return &actions_; }

 private:
  posix_spawn_file_actions_t actions_{};
};

std::string read_all(int descriptor) {
  std::string text;
  std::array<char, 4096> buffer;
  for (;;) {
    const ssize_t got = ::read(descriptor, buffer.data(), buffer.size());
    if (got < 0 && errno == EINTR) continue;
    if (got <= 0) return text;
    text.append(buffer.data(), static_cast<std::size_t>(got));
  }
}

}  // namespace

GnuplotOutcome run_gnuplot(const std::filesystem::path& folder, const std::string& script) {
  int ends[2];
  if (::pipe2(ends, O_CLOEXEC) != 0)
    throw std::runtime_error(std::string("cannot run gnuplot: ") + std::strerror(errno));
  SpawnActions actions;
  const std::string where = folder.empty() ? "." : folder.string();
  posix_spawn_file_actions_addchdir_np(actions.get(), where.c_str());
  posix_spawn_file_actions_addopen(actions.get(), STDIN_FILENO, "/dev/null", O_RDONLY, 0);
  posix_spawn_file_actions_adddup2(actions.get(), ends[1], STDOUT_FILENO);
  posix_spawn_file_actions_adddup2(actions.get(), ends[1], STDERR_FILENO);

  std::string program = "gnuplot", defaults = "--default-settings", file = "./" + script;
  std::array<char*, 4> arguments{program.data(), defaults.data(), file.data(), nullptr};
  pid_t child = 0;
  const int failed = ::posix_spawnp(&child, "gnuplot", actions.get(), nullptr, arguments.data(), environ);
  ::close(ends[1]);
  GnuplotOutcome outcome;
  if (failed != 0) {
    ::close(ends[0]);
    if (failed != ENOENT) throw std::runtime_error(std::string("cannot run gnuplot: ") + std::strerror(failed));
    outcome.found = false;
    outcome.status = 127;
    return outcome;
  }
  outcome.message = read_all(ends[0]);
  ::close(ends[0]);
  int status = 0;
  while (::waitpid(child, &status, 0) < 0 && errno == EINTR) {
  }
  outcome.status = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
  return outcome;
}

namespace {

// Room around axes [cm], for a font of 8 pt.
constexpr double kFont = 8;       // [pt]
constexpr double kSmallFont = 7;  // [pt] of tics and legends
constexpr double kLeft = 1.6, kRight = 0.35, kBelow = 1.02, kBelowShared = 0.28, kAbove = 0.14;
constexpr double kStrip = 0.3, kTitle = 0.42, kLegendLine = 0.33, kLetter = 0.165;
constexpr double kSample = 0.55, kSampleGap = 0.1, kEntryGap = 0.3;  // of a legend's entry
constexpr double kBareMargin = 0.15;
constexpr double kTallest = 22.5;  // [cm] of a figure whose height follows from its aspect
// The cairo terminals set text through Pango, which assumes 96 dots per inch even for 72 units per inch.
constexpr double kPangoPoint = 72.0 / 96;

struct Place {
  double left, right, bottom, top;  // of the axes [cm from the figure's lower left corner]
};

// Letters, not bytes.
double text_width(const std::string& text) {
  return kLetter * static_cast<double>(std::count_if(text.begin(), text.end(), [](char c) {
           return (static_cast<unsigned char>(c) & 0xc0) != 0x80;
         }));
}

// Entries in lines, from left to right; columns are as wide as their longest text.
struct Legend {
  std::vector<const FigureItem*> entries;
  std::vector<double> widths;  // [cm] of columns, samples and gaps included
  int lines() const {
    return widths.empty() ? 0 : static_cast<int>((entries.size() + widths.size() - 1) / widths.size());
  }
  double width() const { return std::accumulate(widths.begin(), widths.end(), 0.0); }
};

std::vector<double> column_widths(const std::vector<const FigureItem*>& entries, std::size_t columns) {
  std::vector<double> widths(columns, 0.0);
  for (std::size_t i = 0; i < entries.size(); ++i)
    widths[i % columns] =
        std::max(widths[i % columns], kSample + kSampleGap + text_width(entries[i]->title) + kEntryGap);
  return widths;
}

Legend legend_of(const FigurePanel& panel, double room) {
  Legend legend;
  if (!panel.legend) return legend;
  for (const FigureItem& item : panel.items) {
    if (!item.title.empty()) legend.entries.push_back(&item);
  }
  if (legend.entries.empty()) return legend;
  std::size_t columns = legend.entries.size();
  const auto width = [&](std::size_t n) {
    const std::vector<double> widths = column_widths(legend.entries, n);
    return std::accumulate(widths.begin(), widths.end(), 0.0);
  };
  while (columns > 1 && width(columns) > room) --columns;
  // The minimum number of columns with the same number of lines, so that the last line is not nearly empty.
  const auto lines = [&](std::size_t n) { return (legend.entries.size() + n - 1) / n; };
  while (columns > 1 && lines(columns - 1) == lines(columns)) --columns;
  legend.widths = column_widths(legend.entries, columns);
  return legend;
}

class Layout {
 public:
  explicit Layout(const Figure& figure) : figure_(figure) {
    const int panels = static_cast<int>(figure.panels.size());
    rows_ = (panels + figure.columns - 1) / figure.columns;
    double right = 0;
    bool bare = true;
    for (const FigurePanel& panel : figure.panels) {
      right = std::max(right, panel.right);
      bare = bare && panel.bare;
    }
    left_ = bare ? kBareMargin : kLeft;
    right_ = (bare ? kBareMargin : kRight) + right;
    axes_width_ = figure.width / figure.columns - left_ - right_;
    if (axes_width_ < 1) throw std::invalid_argument(fmt::format("a figure of {:g} cm is too narrow", figure.width));
    double around = 0;
    for (int row = 0; row < rows_; ++row) around += above(row) + below(row);
    if (figure.height > 0) {
      axes_height_ = (figure.height - around) / rows_;
    } else if (figure.aspect > 0) {
      axes_height_ = std::min(axes_width_ * figure.aspect, (kTallest - around) / rows_);
    } else {
      axes_height_ = figure.panel_height;
    }
    if (axes_height_ < 0.8) throw std::invalid_argument(fmt::format("a figure of {:g} cm is too low", figure.height));
    height_ = around + rows_ * axes_height_;
  }

  double height() const { return height_; }
  double axes_width() const { return axes_width_; }
  double axes_height() const { return axes_height_; }
  Legend legend(const FigurePanel& panel) const { return legend_of(panel, figure_.width / figure_.columns - 0.3); }
  Place place(int panel) const {
    const int row = panel / figure_.columns, column = panel % figure_.columns;
    double top = height_;
    for (int r = 0; r < row; ++r) top -= above(r) + axes_height_ + below(r);
    top -= above(row);
    const double left = figure_.width / figure_.columns * column + left_;
    return {left, left + axes_width_, top - axes_height_, top};
  }

 private:
  template <class Room>
  double most(int row, Room room) const {
    double largest = 0;
    const int end = std::min<int>((row + 1) * figure_.columns, static_cast<int>(figure_.panels.size()));
    for (int i = row * figure_.columns; i < end; ++i)
      largest = std::max(largest, room(figure_.panels[static_cast<std::size_t>(i)]));
    return largest;
  }
  double above(int row) const {
    return most(row, [&](const FigurePanel& panel) {
      const int lines = legend(panel).lines();
      return kAbove + (panel.strip ? kStrip : 0) + (panel.title.empty() ? 0 : kTitle) +
             (lines > 0 ? lines * kLegendLine + 0.08 : 0);
    });
  }
  double below(int row) const {
    return most(row, [](const FigurePanel& panel) {
      return panel.bare ? kBareMargin : panel.shares_x ? kBelowShared : kBelow;
    });
  }

  const Figure& figure_;
  int rows_ = 1;
  double left_ = kLeft, right_ = kRight, axes_width_ = 0, axes_height_ = 0, height_ = 0;
};

std::string terminal_of(const std::string& image, double width, double height) {
  const std::string ending = std::filesystem::path(image).extension().string();
  if (ending == ".pdf") {
    return fmt::format(
        "set terminal pdfcairo enhanced color rounded size {:.2f}cm,{:.2f}cm font 'Helvetica,{:g}' "
        "fontscale {:g} linewidth 0.8 dashlength 1.5",
        width, height, kFont, kPangoPoint);
  }
  if (ending == ".svg") {
    const double pixels = 96 / 2.54;
    return fmt::format(
        "set terminal svg enhanced rounded size {:.0f},{:.0f} font 'sans-serif,{:g}' "
        "fontscale {:.4f} linewidth 1 dashlength 1.5 background '#ffffff'",
        width * pixels, height * pixels, kFont, 96.0 / 72);
  }
  if (ending == ".png") {
    const double pixels = 300 / 2.54, scale = 300.0 / 72;
    return fmt::format(
        "set terminal pngcairo enhanced color rounded size {:.0f},{:.0f} font 'Helvetica,{:g}' "
        "fontscale {:.3f} linewidth {:.3f} pointscale {:.3f} dashlength 1.6",
        width * pixels, height * pixels, kFont, kPangoPoint * scale, 0.8 * scale, scale * 0.6);
  }
  throw std::invalid_argument("'" + plain_line(image) + "': a figure's file ends in .pdf, .svg or .png");
}

void widen(std::pair<double, double>& range, double span) {
  const double middle = (range.first + range.second) / 2;
  range = {middle - span / 2, middle + span / 2};
}

// One metre as long upwards as to the right.
void equalize(FigurePanel& panel, double width, double height) {
  const double dx = panel.x_range.second - panel.x_range.first, dy = panel.y_range.second - panel.y_range.first;
  if (dx / width > dy / height) {
    widen(panel.y_range, dx * height / width);
  } else {
    widen(panel.x_range, dy * width / height);
  }
}

std::string range_text(const std::pair<double, double>& range) {
  return range.first == range.second ? "[*:*]" : fmt::format("[{:.10g}:{:.10g}]", range.first, range.second);
}

std::string plot_command(const Figure& figure, const FigurePanel& panel, const std::string& data) {
  std::string text = "plot";
  const char* separator = " \\\n  ";
  for (const FigureItem& item : panel.items) {
    if (item.block < 0) continue;
    text += separator;
    separator = ", \\\n  ";
    text += data;
    if (figure.blocks.size() > 1) text += fmt::format(" index {}", item.block);
    text += " " + item.style;
  }
  return text + "\n";
}

// Drawn by labels and arrows, so that its position does not depend on gnuplot's estimate of its size. `bottom`: [cm].
std::string legend_text(const Legend& legend, const Layout& layout, const Figure& figure, int index, double bottom) {
  std::string text;
  const auto x = [&](double cm) { return fmt::format("screen {:.5f}", cm / figure.width); };
  const auto y = [&](double cm) { return fmt::format("screen {:.5f}", cm / layout.height()); };
  const double slot = figure.width / figure.columns, slot_left = slot * (index % figure.columns);
  const double left = slot_left + std::max((slot - legend.width() + kEntryGap) / 2, 0.1);
  const std::size_t columns = std::max<std::size_t>(legend.widths.size(), 1);
  for (std::size_t i = 0; i < legend.entries.size(); ++i) {
    const FigureItem& item = *legend.entries[i];
    const std::size_t line = i / columns;
    const double middle = bottom + (legend.lines() - 0.5 - static_cast<double>(line)) * kLegendLine + 0.04;
    const double from =
        std::accumulate(legend.widths.begin(), legend.widths.begin() + static_cast<std::ptrdiff_t>(i % columns), left);
    switch (item.sample.kind) {
      case LegendSample::Kind::line:
        text += fmt::format("set arrow from {0}, {2} to {1}, {2} nohead {3}\n", x(from), x(from + kSample), y(middle),
                            item.sample.style);
        break;
      case LegendSample::Kind::box:
        text += fmt::format("set object rectangle from {}, {} to {}, {} {}\n", x(from), y(middle - 0.085),
                            x(from + kSample), y(middle + 0.085), item.sample.style);
        break;
      case LegendSample::Kind::point:
        text += fmt::format("set label '' at {}, {} point {}\n", x(from + kSample / 2), y(middle), item.sample.style);
        break;
    }
    text += fmt::format("set label {} at {}, {} left noenhanced font ',{:g}'\n", gnuplot_quoted(item.title),
                        x(from + kSample + kSampleGap), y(middle), kSmallFont);
  }
  return text;
}

std::string panel_text(const Figure& figure, FigurePanel panel, const Layout& layout, int index,
                       const std::string& data) {
  const Place at = layout.place(index);
  const auto x = [&](double cm) { return fmt::format("{:.5f}", cm / figure.width); };
  const auto y = [&](double cm) { return fmt::format("{:.5f}", cm / layout.height()); };
  if (figure.equal_axes) equalize(panel, layout.axes_width(), layout.axes_height());

  std::string text = fmt::format("\n# ---- panel {} ----\n", index + 1);
  text += "unset label; unset arrow; unset object; unset logscale; set format '% h'; set xtics autofreq\n";
  text += fmt::format(
      "set lmargin at screen {}; set rmargin at screen {}; set bmargin at screen {}; set tmargin at screen {}\n",
      x(at.left), x(at.right), y(at.bottom), y(at.top));
  text += fmt::format("set xrange {}; set yrange {}\n", range_text(panel.x_range), range_text(panel.y_range));
  if (panel.bare) {
    text += "unset border; unset xtics; unset ytics; unset grid\n";
  }
  if (panel.shares_x) {
    text += "set format x ''\n";
  } else if (!panel.x_label.empty()) {
    text += fmt::format("set label {} at screen {}, screen {} center noenhanced\n", gnuplot_quoted(panel.x_label),
                        x((at.left + at.right) / 2), y(at.bottom - 0.76));
  }
  if (!panel.y_label.empty()) {
    // A long label gets a smaller font instead of overlapping its neighbours.
    const double room = layout.axes_height() + 0.1, wants = text_width(panel.y_label) * kFont / kSmallFont;
    text += fmt::format("set label {} at screen {}, screen {} center rotate by 90 {}font ',{:.3g}'\n",
                        gnuplot_quoted(panel.y_label), x(at.left - kLeft + 0.24), y((at.bottom + at.top) / 2),
                        panel.marked_up ? "" : "noenhanced ", kFont * std::clamp(room / wants, 0.6, 1.0));
  }
  double height = at.top + 0.05 + (panel.strip ? kStrip : 0);
  text += legend_text(layout.legend(panel), layout, figure, index, height);
  if (const int lines = layout.legend(panel).lines(); lines > 0) height += lines * kLegendLine + 0.08;
  if (!panel.title.empty()) {
    text += fmt::format("set label {} at screen {}, screen {} left noenhanced\n", gnuplot_quoted(panel.title),
                        x(at.left), y(height + 0.2));
    height += kTitle;
  }
  for (const FigureLabel& label : panel.labels)
    text += "set label " + gnuplot_quoted(label.text) + " " + label.place + " noenhanced\n";
  for (const std::string& setting : panel.settings) text += setting + "\n";
  return text + plot_command(figure, panel, data);
}

void append_number(double value, std::string& out) {
  if (std::isfinite(value)) {
    fmt::format_to(std::back_inserter(out), "{:.10g}", value == 0 ? 0 : value);
  } else {
    out += "NaN";
  }
}

}  // namespace

std::string figure_data(const Figure& figure) {
  std::string text;
  for (const std::string& head : figure.heads) text += "# " + plain_line(head) + "\n";
  bool first = true;
  for (const FigureBlock& block : figure.blocks) {
    if (!first) text += "\n\n";
    first = false;
    if (!block.about.empty()) text += "# " + plain_line(block.about) + "\n";
    for (std::size_t i = 0; i < block.columns.size(); ++i)
      text += fmt::format("# column {}: {}\n", i + 1, plain_line(block.columns[i]));
    for (const std::vector<double>& row : block.rows) {
      for (std::size_t i = 0; i < row.size(); ++i) {
        if (i > 0) text += ' ';
        append_number(row[i], text);
      }
      text += '\n';
    }
  }
  return text;
}

std::string figure_script(const Figure& figure, const std::string& image, const std::string& data,
                          const std::string& output) {
  const Layout layout(figure);
  std::string text = "# To draw the figure again from this file and its data: gnuplot " +
                     plain_line(std::filesystem::path(image).stem().string()) + ".gp\n";
  for (const std::string& head : figure.heads) text += "# " + plain_line(head) + "\n";
  text += "#\n";  // a head that ends with a backslash would continue the comment on the next line
  text += "set encoding utf8\n";
  text += terminal_of(image, figure.width, layout.height()) + "\n";
  text += "set output " + gnuplot_file(output.empty() ? image : output) + "\n";
  text += fmt::format("set border 3 lw 0.6 lc rgb '{}'\n", kMuted);
  text += fmt::format("set tics out nomirror scale 0.5,0.25 font ',{:g}' textcolor rgb '{}'\n", kSmallFont, kInk);
  text += "set grid back lc rgb '#e4e4e4' lw 0.5 dt solid\nset xtics offset 0,0.2; set ytics offset 0.4,0\n";
  text += "set style fill solid noborder\nunset key\n";
  text += "set multiplot\n";
  for (std::size_t i = 0; i < figure.panels.size(); ++i)
    text += panel_text(figure, figure.panels[i], layout, static_cast<int>(i), gnuplot_file(data));
  return text + "\nunset multiplot\nunset output\n";
}

}  // namespace grapnel
