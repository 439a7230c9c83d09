#include "app/study/verify.h"

#include <tbb/global_control.h>
#include <tbb/info.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "app/commands/commands.h"
#include "app/stages/document.h"
#include "app/stages/folder.h"
#include "app/stages/interrupt.h"
#include "app/stages/stopwatch.h"
#include "base/atomic_file.h"
#include "base/error.h"
#include "base/text.h"

namespace app {

bool verify(const Request& request) {
  const std::vector<sim::VerifyCase> cases = chosen_cases(all_verify_cases(), request.subjects, request.quick);
  if (request.listing && request.json) {
    std::fputs(document_text(list_json(cases)).c_str(), stdout);
    return true;
  }
  if (request.listing) {
    for (const sim::VerifyCase& c : cases) std::printf("%-64s %s\n", c.name.c_str(), c.expect.c_str());
    std::printf("%s\n", base::count_of(cases.size(), "case").c_str());
    return true;
  }
  const std::filesystem::path out = request.out.value_or("out/verify");
  Folder::refuse_for_other_reports(out);
  std::error_code failure;
  std::filesystem::create_directories(out / "pictures", failure);   // before anything runs
  if (failure) base::throw_io(out.string(), failure.message());
  const int threads = request.threads.value_or(tbb::info::default_concurrency());
  // Cases about threads take as many as four, whatever the others share.
  const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, static_cast<std::size_t>(std::max(4, threads)));
  catch_signals();
  surface::initialize();
  base::Progress progress(request.json ? stderr : stdout, request.quiet);
  tbb::task_arena arena(threads);
  const Stopwatch watch;
  const std::vector<Verdict> found = arena.execute([&] { return run_cases(cases, progress); });
  const nlohmann::ordered_json document = verdicts_json(found);
  base::write_text_atomically(out / "verify.json", document_text(document));
  write_verify_page(found, watch.seconds(), threads, out);
  if (request.json) std::fputs(document_text(document).c_str(), stdout);
  else std::fputs((verdicts_text(found) + "report  " + (out / "report.html").string() + "\n").c_str(), stdout);
  return std::all_of(found.begin(), found.end(), [](const Verdict& v) { return v.passed; });
}

}  // namespace app
