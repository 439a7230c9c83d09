# Code generation is the same everywhere: x86-64-v3, no fast-math, no contraction the source does not ask for,
# so that a build on one machine gives the bits of another. Nobody waits for floating-point traps: no value depends on that, and loops with a choice
# in them, or a floor, become vectors.
add_library(polypic_options INTERFACE)
target_compile_options(polypic_options INTERFACE
  -march=x86-64-v3 -ffp-contract=off -fno-math-errno -fno-trapping-math -Wall -Wextra -Wshadow -Werror
  -Wno-restrict)   # g++ 12 warns of impossible sizes inside std::string concatenation (GCC bug 105651)
target_include_directories(polypic_options INTERFACE ${PROJECT_SOURCE_DIR})
set(CMAKE_CXX_FLAGS_RELEASE "-O2")                # sim/ asks for -O3; assertions stay on: they guard our own mistakes
set(CMAKE_CXX_FLAGS_DEBUG "-O1 -g")
if(POLYPIC_SANITIZE)
  set(CMAKE_CXX_FLAGS_DEBUG "-O1 -g1")            # lines are what a report needs; variables take two fifths of the time to compile
  target_compile_options(polypic_options INTERFACE -fsanitize=address,undefined -fno-sanitize-recover=all -fno-omit-frame-pointer
    -fno-sanitize=object-size,null,alignment,pointer-overflow)   # the address sanitizer or an aligned load sees these; half of the time to compile
  target_link_options(polypic_options INTERFACE -fsanitize=address,undefined)
endif()
# What most files of a folder include is compiled once for it: to read it takes up to two seconds a file. Headers of other projects only: one of our
# own would have every file compiled anew when it changes. With them g++ 12 warns of std::string made of a literal where it does not otherwise.
function(polypic_precompile_for target)
  target_precompile_headers(${target} PRIVATE <algorithm> <array> <cmath> <cstdint> <filesystem> <functional> <limits> <map> <memory> <optional>
    <string> <string_view> <vector> <Eigen/Core> <Eigen/Geometry> <fmt/format.h> <tbb/parallel_for.h> ${ARGN})
  target_compile_options(${target} PRIVATE -Wno-array-bounds -Wno-stringop-overread -Wno-stringop-overflow)
endfunction()
find_program(MOLD mold)
if(MOLD)
  target_link_options(polypic_options INTERFACE -fuse-ld=mold)
endif()
find_program(CCACHE ccache)
if(CCACHE)
  set(CMAKE_CXX_COMPILER_LAUNCHER ${CMAKE_COMMAND} -E env CCACHE_SLOPPINESS=pch_defines,time_macros ${CCACHE})
  target_compile_options(polypic_options INTERFACE -fpch-preprocess)   # both: else it leaves alone what has precompiled headers
endif()
