#pragma once

/// @file
/// The symbols that the library exports: only the functions of the standards.

#define GRAPNEL_FMI_FUNCTION extern "C" __attribute__((visibility("default")))
