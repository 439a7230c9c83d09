#pragma once
// One function per group of commands. Results go to standard output; each throws base::Error where it cannot do its work.
#include "app/commands/request.h"

namespace app {

/// run, simulate, surface, render.
void film(const Request&);
/// What a shot will do: effects, attributes, passes.
void plan(const Request&);
/// Shots, materials and looks that come with the program.
void list(const Request&);
/// What is in a file.
void info(const Request&);
/// Two files or runs side by side. False when they differ.
bool diff(const Request&);
/// What accuracy costs in time. False when a variant could not run.
bool cost(const Request&);
/// Runs or pictures on one sheet.
void sheet(const Request&);
/// Runs hard cases and writes a report. False when one fails.
bool verify(const Request&);
/// The keys of a shot file.
void params(const Request&);

/// A pipe whose other end is closed: who reads no further wants to hear nothing more ("| head").
bool has_lost_its_reader(int stream);

/// Carries out a command line. Returns the exit code, after one line on standard error where that is not 0.
int run_command_line(int count, const char* const* words);

}  // namespace app
