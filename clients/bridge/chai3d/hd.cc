// SPDX-License-Identifier: Apache-2.0
// libHD.so: CHAI3D loads it before libhdPhantom.so but uses no symbols from it.
