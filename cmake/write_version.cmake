# Run at build time with -DVERSION -DSOURCE_DIR -DOUTPUT: writes app/version.h's definitions when they changed.
find_program(GIT git)
set(commit "")
if(GIT)
  execute_process(COMMAND ${GIT} -C ${SOURCE_DIR} describe --always --dirty --abbrev=12 --exclude=*
    OUTPUT_VARIABLE commit OUTPUT_STRIP_TRAILING_WHITESPACE ERROR_QUIET)
endif()
file(CONFIGURE OUTPUT ${OUTPUT} @ONLY CONTENT [[
#include "app/version.h"

namespace app {

const char* const kVersion = "@VERSION@";
const char* const kCommit = "@commit@";

}  // namespace app
]])
