// SPDX-License-Identifier: Apache-2.0
// libHD.so: CHAI3D loads this library before libhdPhantom.so but does not use its symbols.
