# toml++ 3 ships a .pc file and no CMake package.
#
#   TomlPlusPlus::tomlplusplus   the compiled library: its parser and printers are not compiled by whoever includes it
#
# Debian: libtomlplusplus-dev.
find_path(TomlPlusPlus_INCLUDE_DIR toml++/toml.h)
find_library(TomlPlusPlus_LIBRARY tomlplusplus)

include(FindPackageHandleStandardArgs)
find_package_handle_standard_args(TomlPlusPlus
  REQUIRED_VARS TomlPlusPlus_INCLUDE_DIR TomlPlusPlus_LIBRARY
  REASON_FAILURE_MESSAGE "install it with: apt-get install libtomlplusplus-dev")

if(TomlPlusPlus_FOUND AND NOT TARGET TomlPlusPlus::tomlplusplus)
  add_library(TomlPlusPlus::tomlplusplus UNKNOWN IMPORTED)
  set_target_properties(TomlPlusPlus::tomlplusplus PROPERTIES
    IMPORTED_LOCATION ${TomlPlusPlus_LIBRARY}
    INTERFACE_INCLUDE_DIRECTORIES ${TomlPlusPlus_INCLUDE_DIR}
    INTERFACE_COMPILE_DEFINITIONS "TOML_HEADER_ONLY=0;TOML_SHARED_LIB=1")
endif()
mark_as_advanced(TomlPlusPlus_INCLUDE_DIR TomlPlusPlus_LIBRARY)
