#pragma once

/// @file
/// What work on a result folder tells its caller while it runs, and how it ends.

#include <string>
#include <vector>

#include "grapnel/campaign/case_pool.hpp"
#include "grapnel/result/time_series.hpp"
#include "grapnel/text/faults.hpp"

namespace grapnel {

/// How work on a result folder ended. The values are the exit codes of the program.
enum class Ending {
  done = 0,
  failed = 1,  // the simulation or its conservation checks failed, or a file could not be written
  bad_input = 2,
  some_failed = 3,   // some points or cases are not ok
  interrupted = 130  // on request; all completed results are kept
};

/// A message about the work: whole lines without the last line end, such as "FILE: warning: ...".
struct Message {
  enum class Kind { remark, warning, error };
  Kind kind = Kind::remark;
  std::string text;
};

/// Receives what happens, in the thread that started the work. This one ignores everything.
class Listener {
 public:
  virtual ~Listener() = default;
  virtual void message(const Message& /*message*/) {}
  /// Text about the work and its results for a reader, unless the options say quiet: whole lines.
  virtual void note(const std::string& /*lines*/) {}
  // Progress, unless the options say quiet: several times a second, and once before the first result.
  virtual void phase(const std::string& /*phase*/, double /*at*/, double /*end*/) {}
  virtual void points(const CaseProgress& /*at*/) {}  // of a sweep or a search
  virtual void cases(const CaseProgress& /*at*/) {}   // of a campaign
  /// The samples of a single run, after each one: those since `block` was last written to the file.
  virtual void samples(const TimeSeries& /*block*/) {}

  void error(const std::string& source, const std::string& text) {
    message({Message::Kind::error, source + ": error: " + text});
  }
  void warning(const std::string& source, const std::string& text) {
    message({Message::Kind::warning, source + ": warning: " + text});
  }
  void remark(const std::string& text) { message({Message::Kind::remark, text}); }
  void faults(const std::vector<Fault>& faults) {
    for (const Fault& fault : faults)
      message({fault.is_warning ? Message::Kind::warning : Message::Kind::error, fault.text()});
  }
};

/// Options of all work on a result folder that simulates captures.
struct FolderOptions {
  int threads = 0;         // 0: one per processor
  bool quiet = false;      // no notes and no progress
  bool no_report = false;  // no report.html
  std::stop_token stop = {};
};

}  // namespace grapnel
