#include "app/stages/interrupt.h"

#include <csignal>
#include <initializer_list>

namespace app {
namespace {

volatile std::sig_atomic_t caught_signal = 0;   // a handler can write nowhere else

void remember(int signal) { caught_signal = signal; }

}  // namespace

Interrupted::Interrupted(int signal, const std::string& saved)
    : std::runtime_error("interrupted; " + (saved.empty() ? "what is finished is kept" : "the simulation is saved in " + saved) +
                         ", and the same command goes on from there"),
      signal_(signal) {}

void catch_signals() {
  struct sigaction action {};
  action.sa_handler = remember;
  action.sa_flags = SA_RESTART | static_cast<int>(SA_RESETHAND);   // the second signal is the default one
  sigemptyset(&action.sa_mask);
  for (const int signal : {SIGINT, SIGTERM}) sigaction(signal, &action, nullptr);
  struct sigaction hangup {};
  sigaction(SIGHUP, nullptr, &hangup);
  if (hangup.sa_handler != SIG_IGN) sigaction(SIGHUP, &action, nullptr);   // under nohup it is ignored, and stays so
}

bool signal_came() { return caught_signal != 0; }

void stop_if_signalled() {
  if (signal_came()) throw Interrupted(caught_signal);
}

void stop_with_nothing_kept() {
  if (signal_came()) throw Interrupted::with_nothing_kept(caught_signal);
}

}  // namespace app
