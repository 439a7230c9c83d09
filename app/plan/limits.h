#pragma once
// What does not fit on this machine is refused before it starts.
#include <filesystem>

#include "app/plan/predict.h"

namespace app {

/// "1.1 GB"
std::string bytes_text(double bytes);

/// Bytes of memory that this process can still get: what the machine has free, and no more than its group or its limits allow.
double free_memory();
/// Of them, what control groups leave: those that `list` names (as /proc/self/cgroup does) and those around them, with their files under `mount`. Files
/// that are cached count as free.
double memory_of_groups(const std::filesystem::path& list, const std::filesystem::path& mount);
/// Bytes that can be written at `path`, or where it will be.
double free_disk(const std::filesystem::path&);

/// What is needed at the very least: what the plan says particles and pictures hold in memory, and on disk the checkpoints, three quarters of the
/// particles' plain size and half of the pictures'.
Prediction least(const Shot&, const FrameRange&);

/// Throws base::Error (exit 2) naming what is needed, what there is, and the key to change.
void require_room(const Shot&, const Prediction&, double memory, double disk);
/// The same of memory that has turned out too small: throws base::Error (exit 2) with the key to change.
[[noreturn]] void refuse_for_memory(const Shot&, const std::string& what);

}  // namespace app
