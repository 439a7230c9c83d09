#pragma once
// SIGINT, SIGTERM and SIGHUP: the work in hand is finished, then the program stops. A second signal ends it at once; files are
// written under temporary names, so nothing half-written stays under a real one.
#include <stdexcept>
#include <string>

namespace app {

/// Thrown between files after a signal; main turns it into exit code 128 + signal (130, 143 or 129).
class Interrupted : public std::runtime_error {
 public:
  /// `saved`: the checkpoint that holds the simulation, or empty.
  explicit Interrupted(int signal, const std::string& saved = "");
  static Interrupted with_nothing_kept(int signal) { return {signal, std::runtime_error("interrupted; nothing is kept: the command begins anew")}; }
  int signal() const { return signal_; }

 private:
  Interrupted(int signal, const std::runtime_error& text) : std::runtime_error(text), signal_(signal) {}
  int signal_;
};

/// From here on SIGINT, SIGTERM and SIGHUP are remembered instead of ending the program.
void catch_signals();
bool signal_came();
/// Throws Interrupted when a signal came.
void stop_if_signalled();
/// The same for a command that finds nothing again when it is given anew.
void stop_with_nothing_kept();

}  // namespace app
