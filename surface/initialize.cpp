#include <openvdb/openvdb.h>

#include "surface/surface.h"

namespace surface {

void initialize() { openvdb::initialize(); }

}  // namespace surface
