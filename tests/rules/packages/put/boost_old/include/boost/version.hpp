// SPDX-License-Identifier: Apache-2.0
#define BOOST_VERSION 106500
#define BOOST_LIB_VERSION "1_65"
