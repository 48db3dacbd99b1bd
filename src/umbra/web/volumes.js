// Shadow volumes as index lists: silhouettes in float64, extruded by the vertex shader.
//
// An even index is a vertex, the next odd one the same vertex at the far end of the volume:
// McGuire's array of twice the vertices. A face adds +1 to the count if it is lit, and -1, in an
// open component, if it is not; an edge's multiplicity is what its two faces add along it.

import { CULLED, Z_PASS, Z_FAIL_CAP, findUnseen, placeShells } from "./placement.js";


/** Indices that grow as needed. */
export class List {
  constructor() {
    this.data = new Uint32Array(1024);
    this.size = 0;
  }

  /**
   * Make room for more indices and return the array.
   * @param {number} more
   */
  reserve(more) {
    if (this.size + more > this.data.length) {
      const grown = new Uint32Array(2 * (this.size + more));
      grown.set(this.data.subarray(0, this.size));
      this.data = grown;
    }
    return this.data;
  }
}

const NOTHING_KEPT = { first: -1, end: -1, at: 0 };

/** A list of which most stays from one listing to the next. */
class LastingList extends List {
  constructor() {
    super();
    this.last = new Uint32Array(0);
    /** What is kept and not copied yet: a run of the last listing, and where it begins here. */
    this.run = NOTHING_KEPT;
  }

  /** Begin a new listing. */
  begin() {
    [this.data, this.last] = [this.last, this.data];
    this.size = 0;
    this.run = NOTHING_KEPT;
  }

  /**
   * Add indices of the last listing.
   * @param {number} first
   * @param {number} end
   */
  keep(first, end) {
    if (first !== this.run.end) {
      this.settle();
      this.run = { first, end, at: this.size };
    }
    this.run.end = end;
    this.size += end - first;
  }

  /** Copy what is kept. */
  settle() {
    const { first, end, at } = this.run;
    this.run = NOTHING_KEPT;
    if (end < 0) return;
    this.size = at;
    super.reserve(end - first).set(this.last.subarray(first, end), at);
    this.size = at + end - first;
  }

  /** @param {number} more */
  reserve(more) {
    this.settle();
    return super.reserve(more);
  }
}

/** The faces of volumes that are drawn with the same stencil operations. */
export class Faces {
  constructor() {
    /** sides and dark caps, wound outward */
    this.wound = new LastingList();
    /** light caps in the winding of the surface, for bit-identical depth */
    this.cap = new List();
    /** light caps of faces seen from behind by the light: their winding is inward */
    this.turned = new List();
  }

  begin() {
    this.wound.begin();
    this.cap.size = this.turned.size = 0;
  }

  get size() {
    return this.wound.size + this.cap.size + this.turned.size;
  }
}

/** The volumes of a model for one light at a time. */
export class Volumes {
  /** @param {Model} model */
  constructor(model) {
    this.model = model;
    /** On which side of each face the light is: 1 at its front, -1 at its back. */
    this.side = new Int8Array(model.faceCount);
    /** What each face adds; the last is that of a border. */
    this.adds = new Int8Array(model.faceCount + 1);
    /** What each adds with the light at its front, and at its back. */
    this.front = new Int8Array(model.faceCount);
    this.back = new Int8Array(model.faceCount);
    /** And with it at the front, where the land is seen from above. */
    this.frontOverLand = new Int8Array(model.faceCount);
    this.cases = new Uint8Array(model.shellCount);
    /** Those of the last listing, and where in it each shell's sides and dark caps are. */
    this.lastCases = new Uint8Array(model.shellCount);
    this.first = new Uint32Array(model.shellCount);
    this.end = new Uint32Array(model.shellCount);
    /** Shells of which faces add something else since then. */
    this.isChanged = new Uint8Array(model.shellCount).fill(1);
    this.isFlat = false;
    this.floor = -Infinity;
    /** @type {import('./assumed_ground.js').AssumedGround | null} if all of it casts and is drawn */
    this.land = null;
    this.isOverLand = false;
    /** The last view, and the shells out of it. */
    this.sight = /** @type {Sight | null} */ (null);
    this.unseen = new Uint8Array(0);
    this.casts = new Uint8Array(model.shellCount);
    this.isClosed = Uint8Array.from(model.isClosed);
    /** Light caps before the surface are drawn where the caster itself is not. */
    this.isHidden = new Uint8Array(model.parts.length);
    this.isCasting = new Uint8Array(model.parts.length);
    this.zPass = new Faces();
    this.zFail = new Faces();
    this.setParts(null, null);
  }

  /**
   * Choose the parts that cast and are drawn. A closed component that casts in part is open.
   * @param {Mask} cast
   * @param {Mask} show
   */
  setParts(cast, show) {
    const { parts, facePart, faceComponent, faceStarts, shellCount, faceCount, isClosed } =
      this.model;
    for (let part = 0; part < parts.length; part++) {
      this.isCasting[part] = !cast || cast[part] ? 1 : 0;
      this.isHidden[part] = !show || show[part] ? 0 : 1;
    }
    this.hidesAny = this.isHidden.includes(1);
    const hasCaster = new Uint8Array(isClosed.length);
    const isAllCasting = new Uint8Array(isClosed.length).fill(1);
    for (let f = 0; f < faceCount; f++) {
      if (this.isCasting[facePart[f]]) hasCaster[faceComponent[f]] = 1;
      else isAllCasting[faceComponent[f]] = 0;
    }
    this.isClosed = isClosed.map((is, k) => is & (isAllCasting[k] | (~hasCaster[k] & 1)));
    const land = this.model.findAssumedGround();
    const isWhole = land?.isPart.every((is, k) => !is || (this.isCasting[k] && !this.isHidden[k]));
    this.land = isWhole ? land : null;
    for (let f = 0; f < faceCount; f++) {
      this.front[f] = this.isCasting[facePart[f]];
      this.back[f] = this.isClosed[faceComponent[f]] ? 0 : -this.front[f];
      this.frontOverLand[f] = this.land?.isPart[facePart[f]] ? 0 : this.front[f];
    }
    for (let shell = 0; shell < shellCount; shell++) {
      this.casts[shell] = 0;
      for (let f = faceStarts[shell]; f < faceStarts[shell + 1] && !this.casts[shell]; f++) {
        this.casts[shell] = this.isCasting[facePart[f]];
      }
    }
  }

  /**
   * Find what each face adds: 1 with the light at its front, and -1 at its back if both sides count.
   * @param {ArrayLike<number>} light homogeneous
   * @param {Uint8Array | null} opened components that follow the open rule for this light
   * @param {boolean} isOverLand whether the land is seen from above: its lit faces add nothing then
   */
  setLight(light, opened, isOverLand) {
    const { faceCount: n, faceComponent, faceStarts, planes, shellCount } = this.model;
    const { adds, isChanged, side } = this;
    const front = isOverLand ? this.frontOverLand : this.front;
    const back = opened
      ? this.back.map((own, f) => (opened[faceComponent[f]] ? -front[f] : own))
      : this.back;
    const [x, y, z, w] = [light[0], light[1], light[2], light[3]];
    for (let shell = 0, f = 0; shell < shellCount; shell++) {
      let changes = 0;
      for (const end = faceStarts[shell + 1]; f < end; f++) {
        const at =
          planes[f] * x + planes[n + f] * y + planes[2 * n + f] * z + planes[3 * n + f] * w;
        // Without branches, as no order of faces foretells on which side the light is.
        const before = Number(at > 0);
        const behind = Number(at < 0);
        const sum = before * front[f] + behind * back[f];
        side[f] = before - behind;
        changes |= sum ^ adds[f];
        adds[f] = sum;
      }
      if (changes) isChanged[shell] = 1;
    }
    if (isOverLand || this.isOverLand) isChanged.fill(1); // other sides are beneath it
    this.isOverLand = isOverLand;
  }

  /**
   * List the faces of the volumes that a view needs, after `setLight`.
   * @param {Sight} sight
   * @param {Throw} thrown
   * @param {boolean} isCut whether parts of drawn casters are cut off from the picture
   */
  list(sight, thrown, isCut) {
    const { model, zPass, zFail, first, end, isChanged } = this;
    [this.cases, this.lastCases] = [this.lastCases, this.cases];
    const { cases, lastCases } = this;
    if (sight !== this.sight) this.unseen = findUnseen(model, sight.findPlanes());
    this.sight = sight;
    placeShells(model, sight, thrown, this.casts, this.unseen, cases);
    zPass.begin();
    zFail.begin();
    const isFlat = !thrown.light[3] && thrown.bottom === -Infinity && !thrown.tip;
    if (isFlat !== this.isFlat || thrown.floor !== this.floor) isChanged.fill(1);
    this.isFlat = isFlat;
    this.floor = thrown.floor;
    const land = this.isOverLand && !thrown.light[3] && thrown.light[2] > 0 ? this.land : null;
    land?.exits.find(thrown.light, this.side);
    let [casters, behind] = [0, 0];
    for (let shell = 0; shell < model.shellCount; shell++) {
      const kind = cases[shell];
      if (kind === CULLED) continue;
      casters += 1;
      const faces = kind === Z_PASS ? zPass : zFail;
      const { wound } = faces;
      const at = wound.size;
      if (kind === lastCases[shell] && !isChanged[shell]) wound.keep(first[shell], end[shell]);
      else {
        if (kind === Z_PASS) this.addSides(shell, wound, isFlat, thrown.floor, land);
        else this.addSides(shell, wound, isFlat, -Infinity, null);
        if (kind !== Z_PASS && !isFlat) this.addDarkCaps(shell, wound);
      }
      first[shell] = at;
      end[shell] = wound.size;
      isChanged[shell] = 0;
      if (kind === Z_PASS) {
        if (isCut || this.hidesAny) this.addLightCaps(shell, faces, !isCut);
      } else {
        behind += 1;
        if (kind === Z_FAIL_CAP) this.addLightCaps(shell, faces, false);
      }
    }
    zPass.wound.settle();
    zFail.wound.settle();
    return { casters, behind };
  }

  /**
   * Add a side for each silhouette edge, as often as its multiplicity.
   * @param {number} shell
   * @param {List} list
   * @param {boolean} isFlat whether all far ends are one point: a triangle is the whole side
   * @param {number} floor z: triangles up to there are left out, as they are before nothing
   * @param {import('./assumed_ground.js').AssumedGround | null} land sides beneath it are left out
   */
  addSides(shell, list, isFlat, floor, land) {
    const { edgeStarts, edgeA, edgeB, edgeTurn, edgeFrom, edgeTo, places } = this.model;
    const { adds, side } = this;
    const [first, end] = [edgeStarts[shell], edgeStarts[shell + 1]];
    const data = list.reserve(12 * (end - first));
    let n = list.size;
    for (let i = first; i < end; i++) {
      const times = adds[edgeA[i]] + edgeTurn[i] * adds[edgeB[i]];
      if (times === 0 || land?.buries(i, side)) continue;
      const from = 2 * (times > 0 ? edgeFrom[i] : edgeTo[i]);
      const to = 2 * (times > 0 ? edgeTo[i] : edgeFrom[i]);
      const isLow = places[1.5 * from + 2] <= floor;
      const isOne = isFlat || isLow || places[1.5 * to + 2] <= floor;
      if (isLow && places[1.5 * to + 2] <= floor) continue;
      for (let k = times > 0 ? times : -times; k > 0; k--) {
        data[n] = to;
        data[n + 1] = from;
        data[n + 2] = isLow ? to + 1 : from + 1;
        n += 3;
        if (isOne) continue;
        data[n] = to;
        data[n + 1] = from + 1;
        data[n + 2] = to + 1;
        n += 3;
      }
    }
    list.size = n;
  }

  /**
   * Add the casting faces of a shell.
   * @param {number} shell
   * @param {Faces} into
   * @param {boolean} hiddenOnly only those of parts that are not drawn
   */
  addLightCaps(shell, into, hiddenOnly) {
    const { faceStarts, faces, facePart } = this.model;
    const [first, end] = [faceStarts[shell], faceStarts[shell + 1]];
    const { adds, isHidden } = this;
    const [cap, turned] = [into.cap, into.turned];
    const front = cap.reserve(3 * (end - first));
    const back = turned.reserve(3 * (end - first));
    for (let f = first; f < end; f++) {
      if (adds[f] === 0 || (hiddenOnly && !isHidden[facePart[f]])) continue;
      const list = adds[f] > 0 ? cap : turned;
      const data = adds[f] > 0 ? front : back;
      for (let k = 0; k < 3; k++) data[list.size + k] = 2 * faces[3 * f + k];
      list.size += 3;
    }
  }

  /**
   * Add the casting faces of a shell at the far end, turned away from the light.
   * @param {number} shell
   * @param {List} list
   */
  addDarkCaps(shell, list) {
    const { faceStarts, faces } = this.model;
    const [first, end] = [faceStarts[shell], faceStarts[shell + 1]];
    const data = list.reserve(3 * (end - first));
    for (let f = first; f < end; f++) {
      const adds = this.adds[f];
      if (adds === 0) continue;
      data[list.size] = 2 * faces[3 * f] + 1;
      data[list.size + 1] = 2 * faces[3 * f + (adds > 0 ? 2 : 1)] + 1;
      data[list.size + 2] = 2 * faces[3 * f + (adds > 0 ? 1 : 2)] + 1;
      list.size += 3;
    }
  }
}
