# Third-party packages, all from Debian 12. Each is used in one folder; docs/building.md says where.
find_package(Threads REQUIRED)
find_package(TBB CONFIG REQUIRED)                 # before OpenVDB, whose own FindTBB would win
find_package(Eigen3 CONFIG REQUIRED)
find_package(nlohmann_json CONFIG REQUIRED)
find_package(fmt CONFIG REQUIRED)
find_library(CHOLMOD_LIB cholmod REQUIRED)        # SuiteSparse 5.12 ships neither a config nor a .pc file
find_path(CHOLMOD_INC cholmod.h PATH_SUFFIXES suitesparse REQUIRED)
add_library(cholmod INTERFACE)
target_link_libraries(cholmod INTERFACE ${CHOLMOD_LIB})
target_include_directories(cholmod SYSTEM INTERFACE ${CHOLMOD_INC})
find_package(hwy CONFIG REQUIRED)
find_package(HDF5 1.10.7 REQUIRED COMPONENTS C)
add_library(hdf5_c INTERFACE)
target_link_libraries(hdf5_c INTERFACE ${HDF5_C_LIBRARIES})
target_include_directories(hdf5_c SYSTEM INTERFACE ${HDF5_C_INCLUDE_DIRS})

if(NOT POLYPIC_SANITIZE)
  set(saved_module_path ${CMAKE_MODULE_PATH})
  list(APPEND CMAKE_MODULE_PATH /usr/lib/${CMAKE_LIBRARY_ARCHITECTURE}/cmake/OpenVDB)
  find_package(OpenVDB 10.0 MODULE REQUIRED COMPONENTS openvdb)
  set(CMAKE_MODULE_PATH ${saved_module_path})     # that folder also holds FindTBB, FindOpenEXR and FindBlosc
  find_package(embree 3.13 CONFIG REQUIRED)
  find_package(assimp 5.2 CONFIG REQUIRED)
  find_package(OpenImageIO 2.4 CONFIG REQUIRED)
  find_package(ZLIB REQUIRED)
  set_target_properties(OpenImageIO::OpenImageIO OpenImageIO::OpenImageIO_Util
    PROPERTIES INTERFACE_INCLUDE_DIRECTORIES "")  # the exported path /usr/include/opencv4 does not exist
  find_package(PkgConfig REQUIRED)
  pkg_check_modules(OSMESA REQUIRED IMPORTED_TARGET osmesa)
  find_package(tomlplusplus CONFIG REQUIRED)
  find_package(CLI11 CONFIG REQUIRED)
endif()
