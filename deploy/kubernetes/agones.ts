// SPDX-License-Identifier: Apache-2.0
//
// The fields of a fleet, from the definitions of Agones 1.57 (install/helm/agones/templates/crds). There is no npm
// package with these types. deploy/kubernetes/check uses them to check overlays/agones.
import type { IPodTemplateSpec } from "kubernetes-models/v1";
import type { IObjectMeta } from "@kubernetes-models/apimachinery/apis/meta/v1/ObjectMeta";

export interface IFleet {
  apiVersion: "agones.dev/v1";
  kind: "Fleet";
  metadata: IObjectMeta;
  spec: {
    replicas?: number;
    allocationOverflow?: { labels?: Record<string, string>; annotations?: Record<string, string> };
    scheduling?: "Packed" | "Distributed";
    strategy?: {
      type?: "Recreate" | "RollingUpdate";
      rollingUpdate?: { maxSurge?: number | string; maxUnavailable?: number | string };
    };
    priorities?: { type?: "Counter" | "List"; key?: string; order?: "Ascending" | "Descending" }[];
    template: {
      metadata?: IObjectMeta;
      spec: {
        template: IPodTemplateSpec;
        container?: string;
        ports?: {
          name?: string;
          range?: string;
          portPolicy?: "Dynamic" | "Static" | "Passthrough" | "None";
          protocol?: "UDP" | "TCP" | "TCPUDP";
          container?: string;
          containerPort?: number;
          hostPort?: number;
        }[];
        sdkServer?: { logLevel?: "Error" | "Info" | "Debug" | "Trace"; grpcPort?: number; httpPort?: number };
        scheduling?: "Packed" | "Distributed";
        health?: { disabled?: boolean; initialDelaySeconds?: number; periodSeconds?: number; failureThreshold?: number };
        counters?: Record<string, { count?: number; capacity?: number }>;
        lists?: Record<string, { capacity?: number; values?: string[] }>;
        eviction?: { safe?: "Always" | "OnUpgrade" | "Never" };
      };
    };
  };
}
