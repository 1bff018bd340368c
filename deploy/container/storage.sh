# SPDX-License-Identifier: Apache-2.0
# Sets the folder for the images of deploy/container/build and deploy/test-container, which is always in build. This
# file must be sourced after deploy/steps.sh.
folder=$root/build/container
mkdir -p "$folder"
buildah() { command buildah --root "$folder/storage" --runroot "$folder/run" --storage-driver vfs "$@"; }
